"""The tables of a rig file about the PLC: where it is, and how the connection to it is secured.

Modbus/TCP Security: both sides show a certificate signed by the authority in ``ca``. All paths are relative to the
rig file, all files PEM.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from drivers.plc.modbus_security import ClientSecurity, Credentials
from drivers.plc.register import Access
from hil.config.table import ExistingFile, Table, TcpPort, Text


class CredentialsTable(Table):
    """What one side trusts and shows; ``key`` without a password."""

    ca: ExistingFile
    certificate: ExistingFile
    key: ExistingFile

    @property
    def credentials(self) -> Credentials:
        """The same as the drivers take it."""
        return Credentials(self.ca, self.certificate, self.key)


class PlcSecurityTable(CredentialsTable):
    """The host's side. ``server_name`` is the name in the PLC's certificate; without it that is ``[plc] host``."""

    server_name: Text | None = None

    @property
    def client(self) -> ClientSecurity:
        """The same as the drivers take it."""
        return ClientSecurity(self.credentials, self.server_name)


class PlcTable(Table):
    """The PLC. ``map`` is relative to the rig file; without it the shipped ``plc.toml`` counts."""

    host: Text
    port: TcpPort
    map: ExistingFile | None = None
    security: PlcSecurityTable | None = None


class SimulatedPlcSecurityTable(CredentialsTable):
    """The simulated PLC's side: its own certificate, and what each role in a client's certificate may do."""

    roles: Annotated[dict[Text, Annotated[Access, Field(strict=False)]], Field(min_length=1)]
