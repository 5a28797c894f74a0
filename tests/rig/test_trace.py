"""A run's bus trace next to its samples, and the samples rebuilt from it: torque and speed the same to the bit."""

from collections.abc import Callable
from pathlib import Path

import can
import pytest

from hil.errors import RecordingError
from hil.rig.replay import replay
from hil.rig.trace import SUFFIXES, BusTrace
from hil.sample import Sample, SampleFlag
from hil.simulator.faults import InverterFaults, RigFaults
from tests.chosen import one_in
from tests.rig.serving import changed, small_rig
from tests.wire.traced import traced_run

MS = 1_000_000
RATED_NM = 600.0
PERIOD_NS = 10 * MS
SYNC, RPDO_M1, RPDO_M2, TPDO_M1, TPDO_M2 = 0x080, 0x201, 0x202, 0x181, 0x182
ENABLED = 0x0237
MEASURED = ("time_s", "torque_m1_nm", "torque_m2_nm", "speed_rad_s", "flags", "age_ns")


def column(rows: list[Sample], name: str) -> list[float]:
    return [getattr(row, name) for row in rows]


@pytest.mark.parametrize("suffix", one_in(3, SUFFIXES))
def test_replay_gives_torque_and_speed_of_the_run(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"run{suffix}"
    live = traced_run(path).rows
    again = list(replay(path, small_rig()))
    for name in MEASURED:
        assert column(again, name) == column(live, name), name
    for name in ("torque_ref_m1_nm", "torque_ref_m2_nm", "prbs_nm"):
        count_nm = RATED_NM / 1000.0
        assert column(again, name) == pytest.approx(column(live, name), abs=2.0 * count_nm)


def test_replay_with_noise_and_stale_answers(tmp_path: Path) -> None:
    """Readings that differ from cycle to cycle, so that a value of the wrong cycle would show."""
    rig = changed(small_rig(), {"simulation": {"speed_noise_rad_s": 0.05, "torque_noise_permille": 2.0}})
    path = tmp_path / "run.blf"
    live = traced_run(path, rig, RigFaults(m2=InverterFaults())).rows
    again = list(replay(path, rig))
    assert len(set(column(live, "speed_rad_s"))) > len(live) // 2
    for name in MEASURED:
        assert column(again, name) == column(live, name), name


def test_whole_trace_has_the_approach_and_the_way_out_too(tmp_path: Path) -> None:
    path = tmp_path / "run.log"
    measured = traced_run(path).rows
    whole = list(replay(path, small_rig(), whole=True))
    assert len(whole) > len(measured)
    assert whole[0].time_s == 0.0
    assert whole[-1].prbs_nm == 0.0


def frames(*rows: tuple[int, int, bytes]) -> list[can.Message]:
    """Frames of a trace: time [ms], identifier, data."""
    return [
        can.Message(timestamp=1.0 + ms / 1e3, arbitration_id=cob_id, data=data, is_extended_id=False)
        for ms, cob_id, data in rows
    ]


def rpdo(prbs: int) -> bytes:
    return b"\x0f\x00" + bytes(2) + prbs.to_bytes(2, "little", signed=True)


def tpdo(torque: int) -> bytes:
    return ENABLED.to_bytes(2, "little") + torque.to_bytes(2, "little", signed=True) + bytes(4)


def cycle(ms: int, torque: int, answer_m2_ms: int = 1, prbs: int = 100) -> list[tuple[int, int, bytes]]:
    """One cycle as it is on the bus; m2 answers so long after the SYNC."""
    return [
        (ms, RPDO_M1, rpdo(prbs)),
        (ms, RPDO_M2, rpdo(prbs)),
        (ms, SYNC, b""),
        (ms + 1, TPDO_M1, tpdo(torque)),
        (ms + answer_m2_ms, TPDO_M2, tpdo(torque)),
    ]


@pytest.fixture
def written(tmp_path: Path) -> Callable[..., Path]:
    def write(*rows: tuple[int, int, bytes]) -> Path:
        path = tmp_path / "made.log"
        with can.Logger(path) as logger:
            for message in frames(*rows):
                logger(message)
        return path

    return write


def test_answer_after_its_time_does_not_count(written: Callable[..., Path]) -> None:
    path = written(*cycle(0, 10), *cycle(10, 20, answer_m2_ms=9), *cycle(20, 30))
    rows = list(replay(path, small_rig()))
    assert column(rows, "torque_m2_nm") == [6.0, 6.0, 18.0]
    assert column(rows, "flags") == [SampleFlag.GOOD, SampleFlag.M2_STALE, SampleFlag.GOOD]
    assert column(rows, "age_ns") == [0, PERIOD_NS, 0]


def trc(version: str, rows: list[tuple[int, int, bytes]]) -> str:
    """PEAK's text log in one of the versions that python-can reads, as PCAN-View and its description have them."""
    start = "45000.5"  # days since 30 December 1899
    head = {
        "1.0": ";   Start time: 15.03.2023 12:00:00.000.0\n",
        "1.1": f";$FILEVERSION=1.1\n;$STARTTIME={start}\n",
        "1.3": f";$FILEVERSION=1.3\n;$STARTTIME={start}\n",
        "2.0": f";$FILEVERSION=2.0\n;$STARTTIME={start}\n;$COLUMNS=N,O,T,I,d,l,D\n",
        "2.1": f";$FILEVERSION=2.1\n;$STARTTIME={start}\n;$COLUMNS=N,O,T,B,I,d,R,L,D\n",
    }[version]
    line = {
        "1.0": "{n}) {ms:.0f} {id:04X} {length} {data}",
        "1.1": "{n}) {ms:.1f} Rx {id:04X} {length} {data}",
        "1.3": "{n}) {ms:.1f} 1 Rx {id:04X} - {length} {data}",
        "2.0": "{n} {ms:.3f} DT {id:04X} Rx {length} {data}",
        "2.1": "{n} {ms:.3f} DT 1 {id:04X} Rx - {length} {data}",
    }[version]
    lines = (
        line.format(n=n, ms=ms, id=cob_id, length=len(data), data=data.hex(" ").upper())
        for n, (ms, cob_id, data) in enumerate(rows, 1)
    )
    return head + ";   Nach der Kopfzeile: \xfc\n" + "\n".join(lines) + "\n"


CYCLES = [row for n in range(8) for row in cycle(10 * n, 10 * n, answer_m2_ms=9 if n == 3 else 1)]


@pytest.mark.parametrize("version", ["1.0", "1.1", "1.3", "2.0", "2.1"])
def test_log_of_peak_gives_the_same_samples_in_every_version(
    version: str, written: Callable[..., Path], tmp_path: Path
) -> None:
    path = tmp_path / "made.trc"
    path.write_text(trc(version, CYCLES), encoding="latin-1")
    again, wanted = list(replay(path, small_rig())), list(replay(written(*CYCLES), small_rig()))
    for name in MEASURED:
        assert column(again, name) == column(wanted, name), name


@pytest.mark.parametrize("spoil", ["cut", "unknown", "text"])
def test_log_of_peak_that_is_damaged_is_refused(spoil: str, tmp_path: Path) -> None:
    """python-can passes over a line that is cut short: a sample would be missing, and nobody would know."""
    path = tmp_path / "made.trc"
    text = trc("2.1", CYCLES)
    path.write_text(
        {"cut": text[:-12], "unknown": text.replace("=2.1", "=9.9"), "text": "no such\nfile\n"}[spoil],
        encoding="latin-1",
    )
    with pytest.raises(RecordingError, match=r"made\.trc: expected a bus trace"):
        list(replay(path, small_rig()))


def two_buses(path: Path) -> Path:
    """A log of two channels with a rig on each; the second's torques are others."""
    other = [(ms, cob_id, data if cob_id != TPDO_M1 else tpdo(77)) for ms, cob_id, data in CYCLES]
    with can.Logger(path) as logger:
        for one, two in zip(frames(*CYCLES), frames(*other), strict=True):
            one.channel, two.channel = 0, 1
            logger(one)
            logger(two)
    return path


NAMES = {".blf": ("1", "2"), ".asc": ("1", "2"), ".log": ("can0", "can1"), ".trc": ("1", "2")}


@pytest.mark.parametrize("suffix", NAMES)
def test_log_of_several_channels_asks_which_and_never_merges_them(
    suffix: str, written: Callable[..., Path], tmp_path: Path
) -> None:
    path = two_buses(tmp_path / f"two{suffix}")
    one, two = NAMES[suffix]
    with pytest.raises(RecordingError, match=rf"got channels {one} \(40 frames\), {two} \(40 frames\)\. Say which"):
        list(replay(path, small_rig()))
    wanted = list(replay(written(*CYCLES), small_rig()))
    for name in MEASURED:
        assert column(list(replay(path, small_rig(), channel=one)), name) == column(wanted, name)
    assert set(column(list(replay(path, small_rig(), channel=two)), "torque_m1_nm")) == {77 * RATED_NM / 1000.0}
    with pytest.raises(RecordingError, match=rf"expected channel 'can7', got channels {one} \(40 frames\)"):
        list(replay(path, small_rig(), channel="can7"))


def public_traffic() -> list[can.Message]:
    """What else is on a vehicle's wire: SAE J1939, other nodes' CANopen, remote frames, error frames, CAN FD."""
    made = []
    for n in range(40):
        at_s = 1.0 + n * 0.002
        fd = {"data": bytes(48), "is_fd": True, "is_extended_id": False}
        made += [
            can.Message(timestamp=at_s, arbitration_id=0x0CF00400, data=bytes(8), is_extended_id=True),
            can.Message(timestamp=at_s, arbitration_id=SYNC, data=b"", is_extended_id=True),
            can.Message(timestamp=at_s, arbitration_id=TPDO_M1, data=tpdo(500), is_extended_id=True),
            can.Message(timestamp=at_s, arbitration_id=RPDO_M2, data=b"\x01", is_extended_id=True),
            can.Message(timestamp=at_s, arbitration_id=TPDO_M1, is_remote_frame=True, dlc=8, is_extended_id=False),
            can.Message(timestamp=at_s, arbitration_id=TPDO_M1, **fd),
            can.Message(timestamp=at_s, arbitration_id=0x1A3, data=bytes(5), is_extended_id=False),
            can.Message(timestamp=at_s, arbitration_id=0x72A, data=b"\x05", is_extended_id=False),
        ]
    return made


@pytest.mark.parametrize("suffix", [".blf", ".log", ".asc"])
def test_public_traffic_spliced_in_changes_no_sample(suffix: str, written: Callable[..., Path], tmp_path: Path) -> None:
    path = tmp_path / f"busy{suffix}"
    everything = sorted([*frames(*CYCLES), *public_traffic()], key=lambda message: message.timestamp)
    with can.Logger(path) as logger:
        for message in everything:
            logger(message)
    again, wanted = list(replay(path, small_rig())), list(replay(written(*CYCLES), small_rig()))
    for name in (*MEASURED, "torque_ref_m1_nm", "prbs_nm"):
        assert column(again, name) == column(wanted, name), name


def test_trace_is_never_overwritten_and_needs_a_place(tmp_path: Path) -> None:
    kept = tmp_path / "kept.log"
    kept.write_text("mine", encoding="utf-8")
    for path, reason in (
        (kept, "never overwritten"),
        (tmp_path / "none" / "a.log", "expected a place to write"),
        (tmp_path / "a.txt", "ends in one of"),
    ):
        with pytest.raises(RecordingError, match=reason), BusTrace(path):
            pass
    assert kept.read_text(encoding="utf-8") == "mine"


def test_trace_is_closed_and_kept_when_the_run_fails(tmp_path: Path) -> None:
    path = tmp_path / "a.blf"

    def fail() -> None:
        with BusTrace(path) as trace:
            trace.take(can.Message(arbitration_id=0x80, is_extended_id=False), 5)
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    with can.LogReader(path) as reader:
        assert [message.arbitration_id for message in reader] == [0x80]
