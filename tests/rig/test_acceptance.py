"""What a drive lacks is accepted by a person, wherever a real drive may be on the bus."""

import pytest

from drivers.inverter.settings import Acceptance
from hil.config.device_tables import AcceptanceTable, AcceptedTable
from hil.config.rig_file import Rig
from hil.errors import UsageError
from hil.rig.build import open_devices
from hil.simulator.addresses import is_simulated_bus
from tests.rig.serving import changed, served, small_rig

FILLED_IN = ("A. Nyone", "a relay of its own")


@pytest.mark.parametrize(
    ("by", "why"),
    [("NAME", FILLED_IN[1]), (FILLED_IN[0], "REASON"), (FILLED_IN[0], " ... "), ("<name>", FILLED_IN[1]), (" ", "-")],
)
def test_a_line_that_was_only_pasted_is_nobodys_acceptance(by: str, why: str) -> None:
    assert not Acceptance(by, why).is_by_a_person
    assert Acceptance(*FILLED_IN).is_by_a_person


def accepting(rig: Rig, by: str) -> Rig:
    table = AcceptedTable(rpdo_deadline=AcceptanceTable(by=by, why=FILLED_IN[1]))
    accepting: Rig = changed(rig, {"inverters.m2": {"accepted": table}})
    return accepting


def test_it_counts_where_drives_are_simulated_and_nowhere_else() -> None:
    with served() as (_, rig), open_devices(accepting(rig, "NAME")) as devices:
        assert devices.m2.settings.accepted["rpdo_deadline"].by == "NAME"
    for url in ("socketcan:can0", "pcan:PCAN_USBBUS1", "ws://10.0.0.7:54701/"):
        real: Rig = changed(accepting(small_rig(), "NAME"), {"can": {"url": url}})
        with pytest.raises(UsageError, match=r"inverters.m2.accepted.rpdo_deadline: .* Nobody has filled it in"):
            open_devices(real).__enter__()


@pytest.mark.parametrize(
    ("url", "simulated"),
    [
        ("virtual:a", True),
        ("socketcan:vcan0", True),
        ("ws://127.0.0.1:54701/token/", True),
        ("ws://[::1]:1/", True),
        ("socketcan:can0", False),
        ("ws://10.0.0.7:1/", False),
        ("ws://vehicle:1/", False),
        ("ws://:x/", False),
    ],
)
def test_where_drives_are_simulated(url: str, simulated: bool) -> None:
    assert is_simulated_bus(url) is simulated
