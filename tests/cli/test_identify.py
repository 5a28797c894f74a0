"""``hil identify`` on real files: what it writes, what it prints, what it refuses."""

import contextlib
import io
import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from estimator.identification.identify import identify
from estimator.identification.linear_model import LinearModel
from hil.cli.main import run
from hil.recording import read_record
from tests.cli.bus_model import MODEL
from tests.estimator.identification.driveline import cruise, true_resonance

ONE_MASS = """schema = "hil.model/1"
structure = "one_mass"
motion = "rotation"

[parameters]
J_M = { value = 100.0, tolerance = 0.2 }
b_M = { value = 0.9, tolerance = 0.2 }
"""


def write(path: Path, seed: int, prbs_nm: float = 60.0, duration_s: float = 22.0) -> Path:
    record = cruise(seed, duration_s=duration_s, prbs_nm=prbs_nm).record
    rows = np.column_stack([record.time_s, record.torque_nm, record.output])
    header = "time_s,torque_m1_nm,torque_m2_nm,speed_rad_s"
    np.savetxt(path, rows, fmt=("%.2f", "%.1f", "%.1f", "%.6f"), delimiter=",", header=header, comments="")
    return path


@pytest.fixture(scope="module")
def recordings(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    folder = tmp_path_factory.mktemp("recordings")
    return [write(folder / f"run_{seed}.csv", seed) for seed in (1, 2)]


@dataclass(frozen=True)
class Identified:
    """What one command printed and wrote."""

    said: str
    complaints: str
    out: Path

    @property
    def document(self) -> dict:
        return dict(json.loads((self.out / "identification.json").read_text()))


@pytest.fixture(scope="module")
def both(recordings: list[Path], tmp_path_factory: pytest.TempPathFactory) -> Identified:
    """Both recordings identified once, with a model and two estimators compared."""
    folder = tmp_path_factory.mktemp("identified")
    (folder / "bus.toml").write_text(MODEL)
    out = folder / "made" / "out"
    more = ("--model", str(folder / "bus.toml"), "--estimator", "rls", "--estimator", "ekf")
    with contextlib.redirect_stdout(io.StringIO()) as said, contextlib.redirect_stderr(io.StringIO()) as complaints:
        assert run(arguments(recordings, out, *more)) == 0
    return Identified(said.getvalue(), complaints.getvalue(), out)


def arguments(recordings: list[Path], out: Path, *more: str) -> list[str]:
    return ["identify", *map(str, recordings), "--out", str(out), *more]


def test_writes_the_identification_of_every_recording(both: Identified) -> None:
    document = both.document
    assert document["schema"] == "hil.identification/1"
    assert [entry["name"] for entry in document["recordings"]] == ["run_1", "run_2"]
    frequency_hz, damping = true_resonance()
    for entry in document["recordings"]:
        for model in (entry["online"], entry["batch"]):
            assert model["resonance"]["frequency_hz"] == pytest.approx(frequency_hz, rel=0.02)
            assert model["resonance"]["damping"] == pytest.approx(damping, rel=0.15)
        assert (entry["online"]["status"], entry["online"]["reason"]) == ("estimated", "")
        assert entry["online"]["samples_used"] == 1024
        assert (entry["batch"]["sample_time_s"], entry["online"]["sample_time_s"]) == (0.01, 0.02)
        spectral = entry["spectral"]
        assert len({len(spectral[key]) for key in ("frequency_hz", "magnitude", "phase_rad", "coherence")}) == 1
    assert sorted(path.name for path in both.out.iterdir()) == ["identification.json", "report.html"]


def test_the_models_read_back_are_those_of_the_estimator_to_the_bit(recordings: list[Path], both: Identified) -> None:
    entry = both.document["recordings"][0]
    result = identify(read_record(recordings[0]))
    assert entry["online"]["theta"] == result.online.theta.tolist()
    assert entry["batch"]["A"] == result.batch.model.A.tolist()
    assert entry["filter_L"] == result.L.tolist()
    nk = entry["online"]["B"].index(next(b for b in entry["online"]["B"] if b))
    online = LinearModel(tuple(entry["online"]["A"][1:]), tuple(entry["online"]["B"][nk:]), nk, 0.02)
    assert online == result.online
    poles = [complex(*pair) for pair in entry["online"]["poles"]]
    np.testing.assert_array_equal(poles, online.poles)


def test_samples_and_period_can_be_chosen_and_the_json_printed_is_the_file(
    recordings: list[Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "bus.toml").write_text(ONE_MASS)
    chosen = ("--samples", "300", "--sample-time", "0.01", "--model", str(tmp_path / "bus.toml"))
    assert run(arguments(recordings[:1], tmp_path, *chosen, "--json")) == 0
    assert capsys.readouterr().out == (tmp_path / "identification.json").read_text()
    document = json.loads((tmp_path / "identification.json").read_text())
    entry = document["recordings"][0]
    assert entry["online"]["samples_used"] == 300
    assert entry["online"]["sample_time_s"] == 0.01
    assert entry["batch"]["sample_time_s"] == 0.01
    assert document["nominal_resonance"] is None  # one mass has none


def test_each_entry_says_how_sure_it_is_and_what_speaks_against_it(both: Identified) -> None:
    frequency_hz, damping = true_resonance()
    for entry in both.document["recordings"]:
        interval = entry["resonance_interval"]
        low, high = interval["frequency_hz"]["ci95"]
        best = entry["best"]
        assert low < best["frequency_hz"] < high
        assert (best["estimator"], best["verdict"]) == ("box_jenkins", "model_good")
        assert best["damping_ci95"][0] < best["damping"] < best["damping_ci95"][1]
        assert "Resonance at 8.2" in best["statement"]
        assert interval["frequency_hz"]["value"] == pytest.approx(frequency_hz, rel=0.01)
        assert interval["damping"]["std"] < 0.1 * damping
        assert len(entry["third_order"]["poles"]) == 3
        validation = entry["validation"]
        assert validation["own"]["fit_percent"] == pytest.approx(entry["batch"]["fit_percent"], abs=2.0)
        assert [unseen["name"] for unseen in validation["unseen"]] == [
            n for n in ("run_1", "run_2") if n != entry["name"]
        ]
        assert set(validation["independence"]) == {"lag", "correlation", "bound", "p_value"}
        assert not entry["feedback"]["detected"]
        J_M = entry["physical"]["parameters"]["J_M"]
        assert (J_M["unit"], J_M["determined"]) == ("kg m^2", True)
        assert J_M["value"] == pytest.approx(1.6, rel=0.1)


def test_the_report_says_what_was_identified(both: Identified) -> None:
    page = (both.out / "report.html").read_text()
    wanted = (
        "Resonance at 8.2",
        "From 2 recordings",
        "Physical parameters",
        "<h2>All recordings",
        "<h2>Recording run_2",
        "Recursive estimators compared",
        "model file",
        "free-run fit",
    )
    assert [text for text in wanted if text not in page] == []
    assert page.count('class="plotly-graph-div"') == 2 + 5 * 2
    compared = both.document["compared"]
    assert [(each["recording"], each["estimator"]) for each in compared] == [
        (name, estimator) for name in ("run_1", "run_2") for estimator in ("rls", "ekf")
    ]
    assert all((each["status"] == "estimated") == (not each["reason"]) for each in compared)


@pytest.mark.parametrize(
    ("more", "named"),
    [
        (("--sample-time", "0.015"), "sampled every 0.01 s, expected a whole fraction"),
        (("--samples", "-3"), "samples is -3, expected 1 or more"),
        (("--model", "nowhere.toml"), "nowhere.toml"),
        (("--order", "0"), "--order: expected a whole number from 1 on, or auto, got '0'"),
        (("--delay", "late"), "--delay: expected a whole number from 0 on, or auto, got 'late'"),
        (("--estimator", "magic"), "--estimator: expected one of oefo, rls"),
        (("--estimator", "ekf"), "Give a two-mass model file by --model"),
    ],
)
def test_wrong_use_is_refused_and_nothing_written(
    recordings: list[Path], tmp_path: Path, capsys: pytest.CaptureFixture[str], more: tuple[str, ...], named: str
) -> None:
    assert run(arguments(recordings[:1], tmp_path / "out", *more)) == 2
    assert named in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_every_recording_that_determines_nothing_is_named_before_any_is_fitted(
    recordings: list[Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bad = [write(tmp_path / "short.csv", 3, duration_s=1.0), write(tmp_path / "constant.csv", 3, prbs_nm=0.0)]
    assert run(arguments([*recordings, *bad], tmp_path / "out")) == 2
    said = capsys.readouterr().err
    assert "recording short: 34 good samples" in said
    assert "recording constant: the torque excites" in said
    assert "superpose a PRBS" in said
    assert "lower the orders" not in said.rpartition("recording constant")[2]
    assert "leave out what is named; recordings without such a fault: 2" in said
    assert not (tmp_path / "out").exists()
