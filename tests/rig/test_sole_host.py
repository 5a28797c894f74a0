"""A second host on a bus listens first, names what it hears, and sends nothing; of two at once at most one drives."""

import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import pytest

from drivers.canopen.can_link import CanLink
from drivers.errors import ForeignController
from drivers.inverter.cia402 import PowerState
from hil.cli.main import run as command
from hil.config.rig_file import Rig
from hil.rig import sole_host
from hil.rig.build import open_devices
from hil.rig.check import check_rig
from hil.rig.experiments.base import Phase
from hil.rig.sole_host import require_sole_host
from hil.simulator.rig_server import RigServer
from tests.chosen import one_in
from tests.rig.observer import assert_disarmed, power_state
from tests.rig.serving import EXAMPLE, Samples, addresses, changed, run_once, served, small_rig

WS = "ws://127.0.0.1:0/"
SENDS = {
    "SYNC": (0x080, b"", r"SYNC \(frame 0x080"),
    "NMT": (0x000, b"\x01\x00", r"an NMT command \(frame 0x000 \[01 00\]"),
    "heartbeat": (0x77F, b"\x05", r"the heartbeat of a host, node 127"),
    "heartbeat of a monitor": (0x77E, b"\x05", r"the heartbeat of a host, node 126"),
    "RPDO": (0x302, b"\x00\x00", r"RPDO 2 for m2"),
    "SDO": (0x601, b"\x40\x00\x10\x00\x00\x00\x00\x00", r"an SDO request to m1"),
}


@contextmanager
def sending(url: str, cob_id: int, data: bytes, period_s: float = 0.05) -> Iterator[None]:
    """Another controller that sends one frame again and again."""
    end = threading.Event()
    with CanLink.open(url) as link:

        def send() -> None:
            while not end.wait(period_s):
                link.send(cob_id, data)

        thread = threading.Thread(target=send)
        thread.start()
        try:
            yield
        finally:
            end.set()
            thread.join()


@contextmanager
def overhearing(url: str) -> Iterator[list[int]]:
    """The identifiers of all that is sent on a bus."""
    heard: list[int] = []
    with CanLink.open(url) as link:
        link.trace_by(lambda message, t_ns: heard.append(message.arbitration_id))
        yield heard


@pytest.mark.parametrize("which", SENDS)
def test_what_only_a_host_sends_is_refused_by_name(which: str) -> None:
    cob_id, data, named = SENDS[which]
    with served(bus_url=WS) as (server, rig), sending(server.bus_url, cob_id, data):
        with pytest.raises(ForeignController, match=named), open_devices(rig):
            pass


def _enabled(server: RigServer, rig: Rig, stack: ExitStack) -> None:
    """Have a host that is silent now leave both drives enabled."""
    devices = stack.enter_context(open_devices(changed(rig, {"can": {"url": server.bus_url}})))
    for inverter in (devices.m1, devices.m2):
        inverter.configure()
        inverter.arm()


@pytest.mark.parametrize("take_over", [False, True])
def test_an_enabled_drive_is_refused_and_stays_enabled(take_over: bool) -> None:
    """Also with --take-over; the bus is one inside this process, where no time is spent on listening."""
    with served() as (server, rig), ExitStack() as stack:
        _enabled(server, rig, stack)
        asked = rig.taking_over() if take_over else rig
        with pytest.raises(ForeignController, match=r"m1 \(node 1\): power state is operation enabled"):
            stack.enter_context(open_devices(asked))
        with pytest.raises(ForeignController, match="operation enabled"):
            check_rig(asked)
        states = [power_state(server.bus_url, node_id) for node_id in (1, 2)]
        assert states == [PowerState.OPERATION_ENABLED] * 2


def test_take_over_continues_where_the_drives_are_disabled() -> None:
    with served(bus_url=WS) as (server, rig), sending(server.bus_url, 0x080, b""), open_devices(rig.taking_over()):
        pass


def test_a_quiet_bus_is_claimed_by_the_heartbeat() -> None:
    with served(bus_url=WS) as (server, rig), overhearing(server.bus_url) as heard:
        with open_devices(rig):
            pass
        assert 0x77F in heard
        heard.clear()
        check_rig(rig)
    assert 0x77F not in heard  # a check reads: a drive must not begin to wait for its heartbeat


def _hosts_at_once(url: str, rigs: list[Rig], delays_s: list[float]) -> list[str | None]:
    """Start hosts at once; what each was refused with, None for one that would drive."""
    ends: list[str | None] = [None] * len(rigs)
    ready, over = threading.Barrier(len(rigs)), threading.Barrier(len(rigs))

    def host(number: int) -> None:
        with CanLink.open(url) as link:
            ready.wait()
            threading.Event().wait(delays_s[number])
            try:
                require_sole_host(link, rigs[number], 0.03)
            except ForeignController as refused:
                ends[number] = str(refused)
            over.wait()  # whoever drives does so until all have begun

    threads = [threading.Thread(target=host, args=(number,)) for number in range(len(rigs))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return ends


@pytest.mark.parametrize("delay_s", one_in(5, [0.0, 0.1, 0.01, 0.3, 0.5]))
@pytest.mark.parametrize("kind", ["two runs", "a run and a monitor"])
def test_two_hosts_started_at_once_do_not_both_drive(
    kind: str, delay_s: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sole_host, "LISTEN_S", 0.4)
    quick = changed(small_rig(), {"inverters.m1": {"host_timeout_ms": 150}, "inverters.m2": {"host_timeout_ms": 150}})
    with served(quick, bus_url=WS) as (server, rig):
        other = rig.of_monitor if kind == "a run and a monitor" else rig
        ends = _hosts_at_once(server.bus_url, [rig, other], [0.0, delay_s])
    refused = [end for end in ends if end is not None]
    assert len(refused) >= 1
    assert all("came from somebody else" in end for end in refused)


@pytest.mark.parametrize(
    "line", one_in(3, [["run", "cruise", "--out", "{out}.csv"], ["check"], ["commission", "--yes", "--out", "{out}"]])
)
def test_commands_refuse_by_exit_status_3(line: list[str], tmp_path: Path, capsys: Any) -> None:
    with served(bus_url=WS) as (server, _), sending(server.bus_url, 0x77F, b"\x05"):
        words = [line[0], str(EXAMPLE), *(word.format(out=tmp_path / "out") for word in line[1:]), *addresses(server)]
        assert command(words) == 3
    assert "heartbeat of a host, node 127" in capsys.readouterr().err


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
