"""A drive that misses its host: when it counts as lost, and what the drive does then."""

from __future__ import annotations

import time
from dataclasses import replace

import pytest

from drivers.canopen.heartbeat import HEARTBEAT_COB_ID
from drivers.errors import DeviceFault
from drivers.inverter.cia402 import PowerState
from hil.simulator.stopping import GRACE_NS, NS_PER_MS, HeartbeatConsumer
from tests.drivers.can_bench import M1, bench, guarded

LONG_NS = 3600 * 1_000_000_000


LOOKS = range(0, GRACE_NS + 1, 10 * NS_PER_MS)
"""A drive looks every 10 ms, for as long as one that was held up itself needs to hear its host again."""


def ended(consumer: HeartbeatConsumer, now_ns: int) -> bool:
    return any(consumer.lost(now_ns + later_ns) for later_ns in LOOKS)


def test_watching_begins_with_the_first_heartbeat() -> None:
    consumer = HeartbeatConsumer(127, timeout_ms=500)
    assert not consumer.lost(LONG_NS)
    consumer.beat(LONG_NS)
    assert not consumer.lost(LONG_NS + 500 * NS_PER_MS)
    assert ended(consumer, LONG_NS + 500 * NS_PER_MS + 1)


def test_a_drive_that_stood_still_hears_its_host_before_it_judges() -> None:
    consumer = HeartbeatConsumer(127, timeout_ms=500)
    consumer.beat(0)
    assert not consumer.lost(LONG_NS)
    consumer.beat(LONG_NS + 1)
    assert not consumer.lost(LONG_NS + GRACE_NS)


def test_time_in_which_the_drive_itself_stood_still_does_not_count() -> None:
    consumer = HeartbeatConsumer(127, timeout_ms=500)
    consumer.beat(0)
    assert not consumer.lost(LONG_NS)
    assert not consumer.lost(2 * LONG_NS)
    assert not consumer.lost(3 * LONG_NS)
    assert ended(consumer, 4 * LONG_NS)


def test_a_loss_counts_once_until_the_heartbeat_is_back() -> None:
    consumer = HeartbeatConsumer(127, timeout_ms=500)
    consumer.beat(0)
    assert ended(consumer, LONG_NS)
    assert not ended(consumer, LONG_NS)
    consumer.beat(LONG_NS)
    assert ended(consumer, 2 * LONG_NS)


def test_a_time_of_zero_is_no_watching() -> None:
    consumer = HeartbeatConsumer()
    consumer.beat(0)
    assert not ended(consumer, LONG_NS)


def test_the_object_holds_node_and_time() -> None:
    consumer = HeartbeatConsumer.from_object(0x007F_01F4)
    assert consumer.cob_id == HEARTBEAT_COB_ID + 127
    consumer.beat(0)
    assert not consumer.lost(500 * NS_PER_MS)
    assert ended(consumer, 501 * NS_PER_MS)


def test_a_drive_without_its_host_gives_no_torque_and_leaves_operation() -> None:
    with bench() as rig:
        for inverter in (rig.m1, rig.m2):
            inverter.configure()
        rig.m1.arm()
        rig.cycle(guarded(120.0))
        assert rig.rig.torque_nm[0] == pytest.approx(120.0)
        rig.link.stop_heartbeat()
        for node in rig.rig._nodes:
            now_ns = time.monotonic_ns() + LONG_NS
            for later_ns in LOOKS:
                node.look_for_host(now_ns + later_ns)
        assert rig.rig.torque_nm == (0.0, 0.0)
        assert rig.rig._nodes[0]._device.state is PowerState.SWITCH_ON_DISABLED
        with pytest.raises(DeviceFault, match="EMCY 0x8130 life guard or heartbeat error"):
            rig.until_raised()


def test_a_drive_watches_its_host_as_soon_as_it_is_configured() -> None:
    """The next heartbeat of the period may be long in coming: a host that dies before it is missed all the same."""
    with bench(settings=replace(M1, host_timeout_ms=60_000)) as rig:
        rig.m1.configure()
        rig.m1.arm()
        rig.m1.command(guarded(120.0))
        assert rig.m1.await_feedback(rig.link.sync(), 5.0) is not None
        assert rig.rig.torque_nm[0] == pytest.approx(120.0)
        rig.link.stop_heartbeat()
        now_ns = time.monotonic_ns() + LONG_NS
        for later_ns in LOOKS:
            rig.rig._nodes[0].look_for_host(now_ns + later_ns)
        assert rig.rig.torque_nm[0] == 0.0
