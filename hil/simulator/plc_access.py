"""Who may do what with the simulated PLC: the role in a client's certificate against a table of roles.

A PLC without certificates lets every client do everything. With them, a client whose certificate names no role, or
one the table does not know, may do nothing: every request of it is answered with exception code 01, as the
Modbus/TCP Security Protocol Specification v2.1 has it for what a role does not allow.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

from drivers.plc.modbus_security import Credentials
from drivers.plc.register import Access

READ_CODES: Final = frozenset({1, 2, 3, 4})
"""Function codes that only read; Modbus Application Protocol V1.1b3, section 6. All others count as writing."""


@dataclass(frozen=True, slots=True)
class PlcSecurity:
    """The PLC's own certificate, and what each role may do.

    Attributes
    ----------
    credentials : Credentials
        What the PLC shows, and the authority that must have signed a client's certificate.
    roles : mapping of str to Access
        What each role may do.
    """

    credentials: Credentials
    roles: Mapping[str, Access] = field(default_factory=dict)

    def allows(self, role: str | None, function_code: int) -> bool:
        """Whether a client of this role, None for no role, may send a request of this function code."""
        access = None if role is None else self.roles.get(role)
        if access is Access.READ:
            return function_code in READ_CODES
        return access is Access.READ_WRITE
