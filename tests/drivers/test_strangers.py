"""Frames that only this host sends, when they come in: the first is kept, and only while the host drives."""

from collections.abc import Callable

import pytest

from drivers.canopen.foreign_controllers import Strangers
from drivers.errors import ForeignController


class Bus:
    def __init__(self) -> None:
        self.callbacks: dict[int, list[Callable[[bytes, int], None]]] = {}

    def subscribe(self, cob_id: int, callback: Callable[[bytes, int], None]) -> None:
        self.callbacks.setdefault(cob_id, []).append(callback)

    def arrive(self, cob_id: int, data: bytes = b"\x05") -> None:
        for callback in self.callbacks[cob_id]:
            callback(data, 0)


@pytest.fixture
def bus() -> Bus:
    return Bus()


@pytest.fixture
def strangers(bus: Bus) -> Strangers:
    made = Strangers(bus.subscribe)
    made.claim(0x080, "SYNC")
    made.claim(0x201, "an RPDO")
    return made


def test_the_first_is_named_and_stays(bus: Bus, strangers: Strangers) -> None:
    strangers.watch()
    strangers.raise_if_seen()
    bus.arrive(0x201, b"\x0f\x00")
    bus.arrive(0x080, b"")
    for _ in range(2):
        with pytest.raises(ForeignController, match=r"^an RPDO \(frame 0x201 \[0f 00\]\) came from somebody else"):
            strangers.raise_if_seen()


def test_nothing_counts_before_and_after(bus: Bus, strangers: Strangers) -> None:
    bus.arrive(0x080)
    strangers.watch()
    strangers.raise_if_seen()
    strangers.end()
    bus.arrive(0x080)
    strangers.raise_if_seen()
    strangers.watch()
    strangers.raise_if_seen()


def test_what_was_seen_is_forgotten_at_the_end(bus: Bus, strangers: Strangers) -> None:
    strangers.watch()
    bus.arrive(0x080)
    strangers.end()
    strangers.raise_if_seen()
    strangers.watch()
    strangers.raise_if_seen()


def test_watching_twice_forgets_nothing(bus: Bus, strangers: Strangers) -> None:
    strangers.watch()
    bus.arrive(0x080)
    strangers.watch()
    with pytest.raises(ForeignController, match="SYNC"):
        strangers.raise_if_seen()


def test_an_identifier_claimed_twice_has_one_callback_and_the_last_name(bus: Bus, strangers: Strangers) -> None:
    strangers.claim(0x080, "another SYNC")
    assert len(bus.callbacks[0x080]) == 1
    strangers.watch()
    bus.arrive(0x080)
    with pytest.raises(ForeignController, match="another SYNC"):
        strangers.raise_if_seen()


def test_what_came_before_the_watch_explains_but_does_not_end(bus: Bus, strangers: Strangers) -> None:
    bus.arrive(0x201, b"\x0f")
    bus.arrive(0x080)
    strangers.watch()
    strangers.raise_if_seen()
    assert strangers.heard == "an RPDO (frame 0x201 [0f])"
