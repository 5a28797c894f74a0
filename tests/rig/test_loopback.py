"""Only this machine's own addresses are served at."""

import pytest

from hil.errors import UsageError
from hil.simulator.addresses import Address, bus_address, host_port, modbus_address


@pytest.mark.parametrize(
    ("text", "address"),
    [
        ("127.0.0.1:5020", Address("127.0.0.1", 5020)),
        ("localhost:0", Address("127.0.0.1", 0)),
        ("[::1]:502", Address("::1", 502)),
    ],
)
def test_reads_loopback_addresses(text: str, address: Address) -> None:
    assert modbus_address(text) == address
    assert bus_address(f"ws://{text}/") == address


def test_reads_addresses_of_other_machines_to_connect_to() -> None:
    assert host_port("plc.example:502") == Address("plc.example", 502)


@pytest.mark.parametrize("text", ["0.0.0.0:502", "192.168.0.7:502", "example.org:502", "[::]:0"])
def test_refuses_what_others_could_reach(text: str) -> None:
    with pytest.raises(UsageError, match="this machine only"):
        modbus_address(text)
    with pytest.raises(UsageError, match="this machine only"):
        bus_address(f"ws://{text}/")


@pytest.mark.parametrize("url", ["socketcan:can0", "wss://127.0.0.1:1/", "127.0.0.1:0"])
def test_refuses_a_bus_url_of_another_kind(url: str) -> None:
    with pytest.raises(UsageError, match="expected ws://"):
        bus_address(url)
