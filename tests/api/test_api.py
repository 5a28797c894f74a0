"""``hil`` from Python: what is read, diagnosed and compared shows itself, and saves what the commands write."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import plotly.graph_objects as go
import pytest

import hil
from hil.errors import RecordingError, UsageError
from tests.cli import bench


@pytest.fixture
def model(tmp_path: Path) -> Path:
    return bench.model(tmp_path / "drive.toml")


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    bench.record(tmp_path / "run_1.csv", 1, noise=0.05)
    return tmp_path / "run_1.csv"


def test_a_recording_is_the_same_from_a_file_and_from_a_table(recording: Path) -> None:
    of_file = hil.read(recording)
    frame = pd.read_csv(recording)
    for table in (frame, frame.set_index("time_s")):
        of_table = hil.Record.from_pandas(table, name="run_1")
        np.testing.assert_array_equal(of_table.torque_nm, of_file.torque_nm)
        np.testing.assert_array_equal(of_table.output, of_file.output)
        assert of_table.sample_time_s == pytest.approx(of_file.sample_time_s)
    assert repr(of_file) == "<Record run_1: 15 s at 0.01 s, 2 torques, speed, 1500 of 1500 samples count>"


def test_moments_as_the_index_are_a_time(recording: Path) -> None:
    frame = pd.read_csv(recording)
    frame.index = pd.Timestamp("2026-03-01") + pd.to_timedelta(frame.pop("time_s"), unit="s")
    assert hil.Record.from_pandas(frame).sample_time_s == pytest.approx(0.01)


def test_columns_by_plain_strings(recording: Path) -> None:
    frame = pd.read_csv(recording)
    frame.columns = ["s", "T1", "T2", "n"]
    of_file = hil.read(recording)
    for given in ({}, {"time": "s"}):
        found = hil.Record.from_pandas(frame, "run_1", torque=["T1", "T2"], speed="n", **given)
        np.testing.assert_array_equal(found.output, of_file.output)
        assert found.sample_time_s == pytest.approx(of_file.sample_time_s)
    assert hil.Record.from_pandas(frame, torque="T1", speed="n").torque_nm.shape[1] == 1
    with pytest.raises(RecordingError, match=r"column w: missing, the frame has s, T1, T2, n\. Name its"):
        hil.Record.from_pandas(frame, torque="T1", speed="w")
    with pytest.raises(RecordingError, match="column time_s: missing"):  # counted rows are no time
        hil.Record.from_pandas(frame.drop(columns="s"), torque="T1", speed="n")


def test_a_look_shows_channels_and_the_table_that_reads_them(recording: Path) -> None:
    found = hil.look(recording)
    assert found.signals == ""
    assert repr(found) == "<run_1.csv: 4 channels; torque torque_m1_nm, torque_m2_nm; output speed_rad_s>"
    assert found.to_dataframe().loc["time_s", "could be"] == "time"
    frame = pd.read_csv(recording).rename(columns={"speed_rad_s": "n [1/min]"})
    frame.to_csv(recording, index=False)
    assert '"n [1/min]"' in hil.look(recording).signals
    assert "read times 0.10472" in hil.look(recording)._repr_html_()
    assert hil.read(recording, signals=hil.look(recording).signals).output[0] == pytest.approx(
        0.104719755 * frame["n [1/min]"][0]
    )
    with pytest.raises(UsageError, match=r"lines of a \[signals\] table such as hil.look\(FILE\).signals, got str"):
        hil.read(recording, signals="n [1/min]")


def test_an_identification_shows_and_saves_itself(model: Path, recording: Path, tmp_path: Path) -> None:
    result = hil.identify(recording, model)
    assert result.to_dataframe().loc["run_1"].isna().all()  # one mass has no resonance
    assert "best: Box-Jenkins, 95 %" in {trace.name for trace in result.plot().data}
    assert repr(result).startswith("<Identification: ")
    assert "run_1" in result._repr_html_()
    with pytest.raises(UsageError, match="expected one of run_1"):
        result.plot("run_7")
    assert {path.name for path in result.save(tmp_path / "found").iterdir()} == {"identification.json", "report.html"}


def test_foreign_columns_by_signals(recording: Path) -> None:
    frame = pd.read_csv(recording).rename(columns={"speed_rad_s": "n"})
    frame["n"] *= 60.0 / (2.0 * np.pi)
    signals = {"speed": {"column": "n", "scale": 2.0 * np.pi / 60.0}}
    found = hil.Record.from_pandas(frame, signals=signals)
    np.testing.assert_allclose(found.output, hil.read(recording).output, atol=1e-9)
    with pytest.raises(UsageError, match="signals: "):
        hil.Record.from_pandas(frame, signals={"sped": {}})
    with pytest.raises(RecordingError, match="speed_rad_s"):
        hil.Record.from_pandas(frame)


def test_a_picture_brings_what_draws_it(recording: Path) -> None:
    shown = hil.read(recording).plot()._repr_mimebundle_()
    assert "plotly.js" in shown["text/html"]
    assert "Plotly.newPlot" in shown["text/html"]
    assert len(shown["application/vnd.plotly.v1+json"]["data"]) == 3


def test_a_recording_as_a_table_and_a_picture(recording: Path) -> None:
    found = hil.read(recording)
    frame = found.to_dataframe()
    assert list(frame.columns) == ["torque_1_nm", "torque_2_nm", "speed", "okay"]
    assert frame.index.name == "time_s"
    figure = found.plot()
    assert isinstance(figure, go.Figure)
    assert [trace.name for trace in figure.data] == ["T_M1", "T_M2", "measured"]


def test_a_diagnosis_shows_and_saves_itself(model: Path, recording: Path, tmp_path: Path) -> None:
    result = hil.diagnose(recording, model, budget_s=300)
    assert result.verdict == "no_mismatch"
    assert repr(result).startswith("<Nothing is missing")
    assert "no mismatch" in result._repr_html_()
    frame = result.to_dataframe()
    assert frame.loc[("", "J_M"), "low"] <= frame.loc[("", "J_M"), "value"] <= frame.loc[("", "J_M"), "high"]
    assert "measured" in {trace.name for trace in result.plot().data}
    with pytest.raises(UsageError, match="expected one of run_1"):
        result.plot("run_7")
    folder = result.save(tmp_path / "out")
    assert sorted(path.name for path in folder.iterdir()) == ["augmented.toml", "diagnosis.json", "report.html"]
    made = json.loads((folder / "diagnosis.json").read_text())["made"]
    assert [each["file"] for each in made["recordings"]] == [str(recording)]


def test_models_are_compared(model: Path, recording: Path, tmp_path: Path) -> None:
    other = bench.model(tmp_path / "other.toml")
    result = hil.compare([model, other], recording)
    frame = result.to_dataframe()
    assert frame.loc[("run_1", "drive.toml"), "rms"] == pytest.approx(0.05, rel=0.06)
    assert "drive.toml off by" in repr(result)
    assert "other.toml" in result._repr_html_()
    assert {"drive.toml", "other.toml"} <= {trace.name for trace in result.plot().data}
    assert (result.save(tmp_path / "out") / "compare.html").exists()
