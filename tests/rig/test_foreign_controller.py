"""Somebody else on the bus who commands the drives: noticed within two cycles, named, and the run is over."""

import pytest

from drivers.canopen.can_link import CanLink
from drivers.errors import ForeignController
from hil.rig.experiments.base import Phase
from tests.rig.observer import assert_disarmed
from tests.rig.serving import Samples, run_once, served, small_rig

AT_S = 0.3
TWO_CYCLES_S = 0.02

FRAMES = {
    "an RPDO": (0x201, b"\x0f\x00\xe8\x03\x00\x00", r"inverter m1 \(node 1\): an RPDO \(frame 0x201 \[0f 00 e8 03"),
    "SYNC": (0x080, b"", r"SYNC \(frame 0x080"),
    "NMT": (0x000, b"\x02\x02", r"an NMT command \(frame 0x000 \[02 02\]\)"),
    "the host's heartbeat": (0x77F, b"\x05", r"the heartbeat of the host, node 127 \(frame 0x77F \[05\]\)"),
    "SDO": (0x602, b"\x40\x41\x60\x00\x00\x00\x00\x00", r"inverter m2 \(node 2\): an SDO request"),
}


@pytest.mark.parametrize("which", ["an RPDO", "SDO"])
def test_a_frame_only_this_host_sends_ends_the_run(which: str) -> None:
    cob_id, data, named = FRAMES[which]
    samples = Samples()
    with served() as (server, rig), CanLink.open(server.bus_url) as stranger:

        def interfere(phase: Phase, time_s: float) -> None:
            if phase is Phase.MEASURE and time_s == AT_S:
                stranger.send(cob_id, data)

        with pytest.raises(ForeignController, match=named):
            run_once(rig, samples, progress=interfere)
        assert_disarmed(server.bus_url, 1, 2)
    assert samples.rows[-1].time_s <= AT_S + TWO_CYCLES_S


def test_who_configured_the_drives_before_does_no_harm() -> None:
    with served() as (server, rig), CanLink.open(server.bus_url) as stranger:
        for cob_id, data, _ in FRAMES.values():
            stranger.send(cob_id, data)
        assert run_once(rig, Samples()).recorded > 0


def test_another_hosts_heartbeat_is_none_of_ours() -> None:
    """`hil monitor` has a node id of its own."""
    rig = small_rig()
    assert (rig.host_node_id, rig.monitor_node_id, rig.of_monitor.host_node_id) == (127, 126, 126)
    with served(rig) as (server, at), CanLink.open(server.bus_url) as monitor:
        monitor.produce_heartbeat(0.02, rig.monitor_node_id)
        assert run_once(at, Samples()).recorded > 0
