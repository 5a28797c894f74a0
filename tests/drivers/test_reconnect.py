"""The bus is lost, and got back in a step of its own: nobody is armed until the drives say they are not."""

import can
import pytest

from drivers.canopen.can_link import BUS_OFF, CanLink
from drivers.errors import BusDown, CommandRefused
from drivers.inverter.cia402 import PowerState
from drivers.inverter.reconnect import reconnect
from tests.drivers.can_bench import M1, M2, bench, guarded, new_channel, virtual_bus


def error_frame(error_class: int) -> can.Message:
    """As an adapter passes it on to its host alone."""
    return can.Message(arbitration_id=error_class, is_error_frame=True, data=bytes(8))


def test_bus_off_is_bus_down_at_every_call() -> None:
    with bench() as rig:
        rig.m1.configure()
        rig.link._take(error_frame(BUS_OFF))
        for step in (rig.link.sync, rig.m1.raise_if_faulted, rig.m1.check):
            with pytest.raises(BusDown, match="bus-off: the controller has left the bus"):
                step()


def test_controller_that_says_it_is_off_the_bus_is_bus_down() -> None:
    class OffBus(can.interfaces.virtual.VirtualBus):
        @property
        def state(self) -> can.BusState:
            return can.BusState.ERROR

    link = CanLink(OffBus(new_channel()))
    with link:
        assert link._thread is not None
        link._thread.join(60.0)
        with pytest.raises(BusDown, match="bus-off"):
            link.sync()


def test_drives_are_disarmed_before_anything_else_and_usable_after_it() -> None:
    with bench() as rig:
        for inverter in (rig.m1, rig.m2):
            inverter.configure()
            inverter.arm()
        rig.cycle(guarded(120.0), guarded(60.0))
        rig.link._take(error_frame(BUS_OFF))
        link, (m1, _) = reconnect(f"virtual:{rig.channel}", (M1, M2), patience_s=0.0)
        with link:
            assert rig.rig.torque_nm == (0.0, 0.0)
            with pytest.raises(CommandRefused, match="while disarmed"):
                m1.command(guarded(120.0))
            m1.configure()
            m1.arm()
            m1.command(guarded(60.0))
            feedback = m1.await_feedback(link.sync(), 5.0)
            assert feedback is not None
            assert feedback.state is PowerState.OPERATION_ENABLED
        with pytest.raises(BusDown):
            rig.link.sync()


def test_bus_that_is_not_there_is_tried_for_so_long_and_no_longer(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("drivers.inverter.reconnect.RETRY_S", 0.001)
    tries: list[str] = []

    def refuse(url: str) -> CanLink:
        tries.append(url)
        raise BusDown(f"CAN bus {url!r} can't be opened")

    monkeypatch.setattr(CanLink, "open", refuse)
    with pytest.raises(BusDown, match="can't be opened"):
        reconnect("virtual:nowhere", (M1,), patience_s=0.05)
    assert len(tries) > 1


def test_bus_that_comes_back_is_used(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("drivers.inverter.reconnect.RETRY_S", 0.001)
    channel, tries = new_channel(), []
    opened = CanLink.open

    def third_time(url: str) -> CanLink:
        tries.append(url)
        if len(tries) < 3:
            raise BusDown("not yet")
        return opened(url)

    monkeypatch.setattr(CanLink, "open", third_time)
    link, inverters = reconnect(f"virtual:{channel}", (), patience_s=5.0)
    with link, virtual_bus(channel) as device:
        link.sync()
        message = device.recv(5.0)
    assert message is not None
    assert (message.arbitration_id, inverters, len(tries)) == (0x080, (), 3)
