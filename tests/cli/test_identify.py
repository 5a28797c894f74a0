"""``hil identify`` on real files: what it writes, what it prints, what it refuses."""

import contextlib
import io
import json
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from estimator.identification.identify import Compared, identify
from estimator.identification.linear_model import LinearModel
from estimator.identification.online.recursive import Status
from estimator.signals.prbs import prbs_nm
from hil.cli.main import run
from hil.recording import read_record
from hil.report.identification_page import compared_summary
from tests.benchmarks.buses import Line
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
        assert {len(spectral[key]) for key in ("frequency_hz", "magnitude", "phase_rad", "coherence")} == {256}
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


def test_prints_a_short_table(both: Identified) -> None:
    assert "run_2" in both.said
    assert "8.2" in both.said
    assert "Hz" in both.said
    assert str(both.out / "identification.json") in both.said.replace("\n", "")
    assert both.complaints == ""  # no progress where nobody watches


def test_a_model_file_adds_what_was_expected(both: Identified) -> None:
    nominal = both.document["nominal_resonance"]
    assert (nominal["frequency_hz"], nominal["damping"]) == pytest.approx(true_resonance())
    assert "model file" in both.said


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


def test_the_terminal_says_why_a_compared_estimate_is_invalid(capsys: pytest.CaptureFixture[str]) -> None:
    cases = (
        Compared("run_1", "riv", None, 85.0, Status.ESTIMATED),
        *(
            Compared("run_1", name, None, math.nan, Status.INVALID, "a pole on the unit circle")
            for name in ("rls", "oeepm")
        ),
    )
    Console(width=80).print(compared_summary(cases))
    printed = capsys.readouterr().out
    assert "run_1, rls: a pole on the unit circle" in printed
    assert "run_1, oeepm: a pole on the unit circle" in printed
    assert "run_1, riv:" not in printed


def test_a_torque_that_moves_the_speed_next_to_nothing_is_reported(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    weak = write(tmp_path / "weak.csv", 1, prbs_nm=2.0)
    assert run(arguments([weak], tmp_path / "out")) == 0
    printed = " ".join(capsys.readouterr().out.split())
    assert "most of the speed is not caused by the torque" in printed
    assert "Raise the PRBS" in printed


def with_more_signals(recording: Path, folder: Path) -> list[str]:
    """Write the recording with a wheel's speed and a brake's torque, and a model file that names them."""
    header, *rows = recording.read_text(encoding="utf-8").splitlines()
    more = [f"{header},wheel,brake", *(f"{row},{row.rpartition(',')[2]},0.0" for row in rows)]
    (folder / "more.csv").write_text("\n".join(more), encoding="utf-8")
    wheel = '{ kind = "speed", at = "load", column = "wheel" }'
    signals = f'{MODEL}\n[signals]\noutputs = [{wheel}]\nload = {{ column = "brake" }}\n'
    (folder / "model.toml").write_text(signals, encoding="utf-8")
    return arguments([folder / "more.csv"], folder / "out", "--model", str(folder / "model.toml"))


def test_order_and_delay_are_chosen_where_they_are_left_open_and_what_is_not_used_is_named(
    recordings: list[Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = with_more_signals(recordings[0], tmp_path)
    assert run([*words, "--order", "3", "--delay", "auto", "--json"]) == 0
    printed = capsys.readouterr()
    assert [line for line in printed.err.splitlines() if "not used" in line] == [
        "note: identified from motor torque to the first output; not used: the output wheel, the measured load torque. "
        "See hil diagnose."
    ]
    document = json.loads(printed.out)
    candidates = document["order_choice"]["candidates"]
    assert sorted(each["nk"] for each in candidates) == [0, 1, 2, 3]
    assert {each["na"] for each in candidates} == {3}
    assert candidates[0]["criterion"] == 0.0 == min(each["criterion"] for each in candidates)
    assert document["settings"]["nk"] == candidates[0]["nk"]
    # the next sample's torque is in a low-passed one already: a delay of 2 or 3 can only be worse
    assert candidates[0]["nk"] in (0, 1)
    assert document["recordings"][0]["batch"]["fit_percent"] > 80.0
    assert "Order and delay" in (tmp_path / "out" / "report.html").read_text()


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


def test_a_recording_without_excitation_is_refused_by_name(
    recordings: list[Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    quiet = write(tmp_path / "quiet.csv", 3, prbs_nm=0.0)
    assert run(arguments([recordings[0], quiet], tmp_path / "out")) == 2
    message = capsys.readouterr().err
    assert "recording quiet" in message
    assert "a_1, a_2, a_3, a_4, b_1, b_2, b_3, b_4 can't be determined" in message
    assert not (tmp_path / "out").exists()


def test_a_recording_too_short_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    short = write(tmp_path / "short.csv", 3, duration_s=1.5)
    assert run(arguments([short], tmp_path / "out")) == 2
    assert "expected at least 80 for 8 parameters" in capsys.readouterr().err


def stiff_line(path: Path) -> Path:
    """Write 20 s of a line at 65 Hz, sampled every 10 ms as it would be: the exact motion under held torque."""
    line, rng = Line(1.6, 100.0, 262_000.0, 30.0, 0.35, 0.9), np.random.default_rng(0)
    step, by_torque = line.held(0.01)
    n = 2000
    torque, x = 75.0 + prbs_nm(n, 60.0), np.array([0.0, 0.0, 60.0, 60.0])
    speed = np.zeros(n)
    for i in range(n):
        speed[i] = x[2]
        x = step @ x + by_torque @ (torque[i], 0.0)
    rows = np.column_stack([0.01 * np.arange(n), 0.5 * torque, 0.5 * torque, speed + 0.02 * rng.normal(size=n)])
    np.savetxt(path, rows, delimiter=",", header="time_s,torque_m1_nm,torque_m2_nm,speed_rad_s", comments="")
    return path


def test_a_mode_beyond_half_the_sampling_rate_may_have_been_folded(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = stiff_line(tmp_path / "stiff.csv")
    assert run(["identify", str(path), "--out", str(tmp_path / "out")]) == 0
    words = " ".join(capsys.readouterr().out.split())
    assert "are too few for its damping: record every" in words
    assert "A mode above 50 Hz would look the same" in words
