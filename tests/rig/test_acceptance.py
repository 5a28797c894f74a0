"""What a drive lacks is accepted by a person, wherever a real drive may be on the bus."""

import pytest

from drivers.inverter.settings import Acceptance
from hil.simulator.addresses import is_simulated_bus

FILLED_IN = ("A. Nyone", "a relay of its own")


@pytest.mark.parametrize(
    ("by", "why"),
    [("NAME", FILLED_IN[1]), (FILLED_IN[0], "REASON"), (FILLED_IN[0], " ... "), ("<name>", FILLED_IN[1]), (" ", "-")],
)
def test_a_line_that_was_only_pasted_is_nobodys_acceptance(by: str, why: str) -> None:
    assert not Acceptance(by, why).is_by_a_person
    assert Acceptance(*FILLED_IN).is_by_a_person


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
