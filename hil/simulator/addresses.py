"""Addresses of a simulated rig: this machine's own and no other, and a rig at others than its file's.

The CAN server knows a token but no encryption, and a simulated PLC certificates only where the rig file says so:
neither may be reached from outside.
"""

from __future__ import annotations

import ipaddress
from dataclasses import dataclass
from urllib.parse import urlsplit

from hil.config.rig_file import Rig
from hil.errors import UsageError

IN_PROCESS = "virtual:"  # beginning of the bus URLs that are served inside this process only

SOCKETCAN = "socketcan:vcan"
"""Beginning of the bus URLs of the Linux kernel's virtual buses. A simulated drive on a real one could answer in the
place of a drive that carries torque."""


@dataclass(frozen=True, slots=True)
class Address:
    """A TCP address; port 0 lets the system choose a free one."""

    host: str  # name or IP address, an IPv6 one without brackets
    port: int  # 0 to 65535

    def __str__(self) -> str:
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{host}:{self.port}"


def host_port(text: str) -> Address:
    """Read ``HOST:PORT``, on whatever machine."""
    return _read(f"//{text}", text, "HOST:PORT, for example 127.0.0.1:5020")


def modbus_address(text: str) -> Address:
    """Read ``HOST:PORT`` of this machine."""
    return _on_this_machine(host_port(text), text)


def bus_address(url: str) -> Address:
    """Read ``ws://HOST:PORT/`` of this machine."""
    expected = "ws://HOST:PORT/, for example ws://127.0.0.1:0/"
    if urlsplit(url).scheme != "ws":
        raise UsageError(f"bus {url!r}: expected {expected}. Give it with --bus or in [can] of the rig file.")
    return _on_this_machine(_read(url, url, expected), url)


def is_simulated_bus(url: str) -> bool:
    """Tell whether a bus can hold simulated drives only: one that a simulated rig may be served at."""
    if url.startswith((IN_PROCESS, SOCKETCAN)):
        return True
    try:
        bus_address(url)
    except UsageError:
        return False
    return True


def _read(url: str, text: str, expected: str) -> Address:
    try:
        parts = urlsplit(url)
        host, port = parts.hostname, parts.port
    except ValueError as error:
        raise UsageError(f"address {text!r}: {error}; expected {expected}.") from error
    if host is None or port is None:
        raise UsageError(f"address {text!r}: expected {expected}.")
    return Address("127.0.0.1" if host == "localhost" else host, port)


def _on_this_machine(address: Address, text: str) -> Address:
    if _is_loopback(address.host):
        return address
    raise UsageError(
        f"address {text!r}: a simulated rig is served on this machine only, without encryption; expected "
        "a loopback address such as 127.0.0.1. To reach it from elsewhere, tunnel the port with SSH."
    )


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def with_addresses(rig: Rig, bus: str | None, modbus: str | None, take_over: bool = False) -> Rig:
    """Replace the addresses that are given; ``take_over`` lets another host be on the bus (`hil.rig.sole_host`)."""
    rig = rig.taking_over() if take_over else rig
    can, plc = rig.can, rig.plc
    if bus is not None:
        can = can.model_copy(update={"url": bus})
    if modbus is not None:
        address = host_port(modbus)
        plc = plc.model_copy(update={"host": address.host, "port": address.port})
    return rig.model_copy(update={"can": can, "plc": plc})
