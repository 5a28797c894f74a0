"""MDF as loggers write it: groups of different rates, and a logged bus with a DBC file; all files are made here."""

from __future__ import annotations

import importlib
import struct
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import can
import can.io.mf4
import numpy as np
import pytest
from asammdf import MDF, Signal

from estimator.signals import decimate
from hil.cli.main import run
from hil.errors import RecordingError
from hil.recording import SignalsConfig, read_record, read_table, resample
from hil.recording.look import look
from hil.recording.request import Request
from hil.recording.resample import Series, resampled

LONG_S = 4.0


def signals(**more: Any) -> SignalsConfig:
    tables: Mapping[str, Any] = {
        "torque": [{"column": "T_M1"}, {"column": "T_M2"}],
        "speed": {"column": "n_M"},
        **more,
    }
    return SignalsConfig.model_validate(tables)


def slow(time: np.ndarray) -> np.ndarray:
    return 50.0 * np.sin(2.0 * np.pi * 1.5 * time)


@pytest.fixture
def three_rates(tmp_path: Path) -> Path:
    """Torques every 10 and 5 ms, speed every 2 ms with a tone that a period of 10 ms can't hold, a gear twice."""
    path = tmp_path / "drive.mf4"
    ten, five, two = (np.arange(0.0, LONG_S, step) + 0.0003 for step in (0.01, 0.005, 0.002))
    with MDF(version="4.11") as mdf:
        mdf.append([Signal(slow(ten), ten, name="T_M1", unit="Nm")])
        mdf.append([Signal(slow(five) / 1e3, five, name="T_M2", unit="kNm")])
        tone = 20.0 * np.sin(2.0 * np.pi * 90.0 * two)
        mdf.append([Signal(slow(two) + tone, two, name="n_M", unit="rpm")])
        mdf.append(
            [Signal(np.arange(4), np.arange(4.0), name="gear"), Signal(np.arange(4), np.arange(4.0), name="count")]
        )
        mdf.append([Signal(np.arange(3), np.arange(3.0), name="gear")])
        mdf.save(path)
    return path


def test_groups_of_different_rates_are_brought_to_one_period_and_that_is_said(three_rates: Path) -> None:
    said: list[str] = []
    record = read_record(three_rates, signals(resample_s=0.01), tell=said.append)
    assert record.sample_time_s == pytest.approx(0.01)
    inside = slice(20, -20)
    np.testing.assert_allclose(record.torque_nm[inside, 0], slow(record.time_s)[inside], atol=0.05)
    np.testing.assert_allclose(record.torque_nm[inside, 1], slow(record.time_s)[inside], atol=0.2)
    speed = record.output[inside] / (2.0 * np.pi / 60.0)
    np.testing.assert_allclose(speed, slow(record.time_s)[inside], atol=0.2)  # of the tone of 20 nothing is left
    assert [line.split(": ", 1)[1] for line in said] == [
        "T_M1: 0.01 s brought to 0.01 s, straight lines between its samples",
        "T_M2: 0.005 s brought to 0.01 s, low-pass at 50 Hz and thinned",
        "n_M: 0.002 s brought to 0.01 s, low-pass at 50 Hz and thinned",
        "T_M2: read in kNm, times 1000",
        "n_M: read in rpm, times 0.10472",
    ]


def test_the_times_of_the_channels_asked_for_are_read_whatever_else_is_in_the_file(three_rates: Path) -> None:
    table = read_table(three_rates, Request(columns=("n_M",)))
    assert (table.master, list(table.columns)) == ("time", ["time", "n_M"])
    assert read_table(three_rates).columns.keys() == {"time", "gear", "count"}


@pytest.fixture
def somewhere(tmp_path: Path) -> Path:
    (tmp_path / "a.mf4").write_bytes(b"")
    return tmp_path / "a.mf4"


@pytest.mark.parametrize("period_s", [0.01, 0.05], ids=["as fast", "thinned"])
def test_a_gap_is_missing_samples(somewhere: Path, period_s: float) -> None:
    time = np.arange(0.0, 10.0, 0.01)
    kept = (time < 4.0) | (time > 6.0)
    raster, columns, _ = resampled(somewhere, {"n": Series(time[kept], slow(time[kept]))}, period_s)
    missing = raster[np.isnan(columns["n"])]
    assert 4.0 <= missing.min() < 4.0 + 2 * period_s
    assert 6.0 - 2 * period_s < missing.max() <= 6.0 + 2 * period_s


DBC = """VERSION ""
BS_:
BU_: M1
BO_ 385 M1: 8 M1
 SG_ T_M1 : 0|16@1- (0.1,0) [-1000|1000] "Nm" M1
 SG_ T_M2 : 16|16@1- (0.1,0) [-1000|1000] "Nm" M1
 SG_ n_M : 32|32@1- (0.01,0) [-10000|10000] "rpm" M1
"""

J1939 = """VERSION ""
BS_:
BU_: M1
BO_ 2566848766 M1: 8 M1
 SG_ T_M1 : 0|16@1- (0.1,0) [-1000|1000] "Nm" M1
 SG_ T_M2 : 16|16@1- (0.1,0) [-1000|1000] "Nm" M1
 SG_ n_M : 32|32@1- (0.01,0) [-10000|10000] "rpm" M1
BA_DEF_ BO_ "VFrameFormat" ENUM "StandardCAN","ExtendedCAN","reserved","J1939PG";
BA_DEF_ "ProtocolType" STRING ;
BA_DEF_DEF_ "VFrameFormat" "J1939PG";
BA_DEF_DEF_ "ProtocolType" "J1939";
BA_ "ProtocolType" "J1939";
BA_ "VFrameFormat" BO_ 2566848766 3;
"""
"""A message of PGN 0xFF00, as sent by node 0xFE; the frames come from another node."""

FROM_NODE_3 = 0x18FF0003


def bus_writer(path: Path) -> Any:
    """Open python-can's writer; its module takes asammdf, which imports it, for missing where that came first."""
    return importlib.reload(can.io.mf4).MF4Writer(str(path))


@pytest.fixture(params=["CAN", "J1939"])
def bus_log(request: pytest.FixtureRequest, tmp_path: Path) -> tuple[Path, Path]:
    """Frames of a bus as python-can's MDF writer logs them, and the DBC file of that bus."""
    extended = request.param == "J1939"
    path, dbc = tmp_path / "bus.mf4", tmp_path / "bus.dbc"
    dbc.write_text(J1939 if extended else DBC, encoding="ascii")
    with bus_writer(path) as writer:
        for k in range(60):
            data = struct.pack("<hhi", 10 * k, -5 * k, 100 * k)
            frame_id = FROM_NODE_3 if extended else 385
            writer.on_message_received(
                can.Message(
                    timestamp=1.77e9 + 0.01 * k, arbitration_id=frame_id, is_extended_id=extended, data=data, channel=1
                )
            )
    return path, dbc


def test_without_a_dbc_a_logged_bus_says_what_is_needed(bus_log: tuple[Path, Path]) -> None:
    path, _ = bus_log
    with pytest.raises(RecordingError, match=r"got the frames of a bus as they were logged.*--dbc FILE"):
        read_record(path, signals())


def test_a_logged_bus_is_decoded_by_its_dbc(bus_log: tuple[Path, Path]) -> None:
    path, dbc = bus_log
    record = read_record(path, signals(), dbc=dbc)
    assert record.sample_time_s == pytest.approx(0.01, rel=1e-3)
    np.testing.assert_allclose(record.torque_nm, np.column_stack([np.arange(60.0), -0.5 * np.arange(60)]), atol=1e-9)
    np.testing.assert_allclose(record.output, np.arange(60.0) * 2.0 * np.pi / 60.0)


def test_a_logged_bus_is_converted_by_its_dbc(bus_log: tuple[Path, Path], tmp_path: Path) -> None:
    path, dbc = bus_log
    assert run(["convert", str(path), str(tmp_path / "bus.parquet"), "--dbc", str(dbc)]) == 0
    table = read_table(tmp_path / "bus.parquet")
    assert table.n_rows == 60
    np.testing.assert_allclose(table.numeric(["T_M1"])["T_M1"], np.arange(60.0), atol=1e-9)
    assert run(["convert", str(path), str(tmp_path / "none.parquet")]) == 2


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("bus.txt", DBC, r"expected a DBC file \(\.dbc\), an EDS or a DCF"),
        ("other.dbc", DBC.replace("BO_ 385", "BO_ 900"), "got none of them"),
        ("empty.dbc", 'VERSION ""\n', "one without any"),
        ("broken.dbc", "BO_ what\n SG_ :::\n", "DBC file"),
        ("gone.dbc", None, "expected a DBC file, got"),
    ],
)
def test_a_dbc_that_does_not_fit_is_refused(tmp_path: Path, name: str, content: str | None, said: str) -> None:
    path = tmp_path / "bus.mf4"
    with bus_writer(path) as writer:
        for k in range(20):
            frame = can.Message(timestamp=1.77e9 + 0.01 * k, arbitration_id=385, is_extended_id=False, data=bytes(8))
            writer.on_message_received(frame)
    if content is not None:
        (tmp_path / name).write_text(content, encoding="ascii")
    with pytest.raises(RecordingError, match=said):
        read_table(path, Request(dbc=tmp_path / name))


OWN_EDS = Path(__file__).parents[2] / "eds" / "inverter.eds"
RATED_NM, RPM_COUNT = 600.0, 0.001 * 2.0 * np.pi / 60.0
"""What the EDS says: per mille of its 0x6076, and thousandths of 1/min by its 0x60A9."""


def log_of_two_drives(path: Path, data: bytes = b"") -> Path:
    """Frames of TPDO 1 of nodes 1 and 2 as the EDS maps them: status word, torque, velocity."""
    with bus_writer(path) if path.suffix == ".mf4" else can.Logger(str(path)) as log:
        for k in range(300):
            for node, torque in ((1, k % 70), (2, -(k % 40))):
                frame = data or struct.pack("<Hhi", 0x1237, torque, 9000 * k)
                log.on_message_received(
                    can.Message(1.77e9 + 0.01 * k, 0x180 + node, is_extended_id=False, data=frame, channel=1)
                )
    return path


@pytest.mark.parametrize("suffix", [".mf4", ".log", ".blf"])
def test_a_logged_bus_is_decoded_by_the_eds_of_its_drives(suffix: str, tmp_path: Path) -> None:
    path = log_of_two_drives(tmp_path / f"bus{suffix}")
    found = look(path, OWN_EDS)
    assert [guess.channel.name for guess in found.roles.torques] == ["Torque_actual_value_1", "Torque_actual_value_2"]
    table = tomllib.loads("\n".join(found.signals))["signals"]
    record = read_record(path, SignalsConfig.model_validate(table), dbc=OWN_EDS)
    k = np.arange(300)
    torque_nm = np.column_stack([k % 70, -(k % 40)]) * RATED_NM / 1000.0
    np.testing.assert_allclose(record.torque_nm, torque_nm, atol=1e-6)
    np.testing.assert_allclose(record.output, 9000 * k * RPM_COUNT, atol=1e-6)


def test_the_low_pass_is_that_of_the_on_line_chain() -> None:
    assert (resample.EDGE, resample.HALF_LENGTH) == (decimate.EDGE, decimate.HALF_LENGTH)
