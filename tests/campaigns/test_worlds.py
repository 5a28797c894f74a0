"""Worlds of other forms: they agree where they must, differ where they should, and are counted as they are."""

import argparse
from pathlib import Path

import numpy as np
import pytest

from hil.config.model_file import read_model
from hil.proof.truth.bus import draw_bus
from hil.proof.truth.driveline import TruthDriveline
from hil.proof.truth.specimen import NOTHING, Stream, stream
from tests.campaigns import engine, worlds
from tests.campaigns.forms import FORMS, Line, Role, drive, make_form
from tests.campaigns.worlds import ALL, Row, continued, parse_forms, table

BUS = draw_bus(stream(5, Stream.BUS))
LINE = Line(BUS.J_M, BUS.J_L, BUS.k, BUS.c, BUS.b_M, BUS.b_L, BUS.load_torque_nm)
TORQUE_NM = 60.0 + np.repeat(150.0 * np.random.default_rng(1).choice([-1.0, 1.0], 100), 3)
START_RAD_S = 2.0


def test_a_line_without_a_law_is_the_truth_simulator_s() -> None:
    plant, speeds = TruthDriveline(BUS.physics(), START_RAD_S), []
    for torque_nm in TORQUE_NM.tolist():
        speeds.append(plant.speed_rad_s)
        plant.advance((0.5 * torque_nm, 0.5 * torque_nm), 0.01)
    np.testing.assert_allclose(drive(LINE, START_RAD_S, TORQUE_NM), speeds, atol=1e-3)  # a fiftieth of the noise


def test_the_engine_s_line_without_an_effect_is_the_same() -> None:
    pytest.importorskip("mujoco", reason="MuJoCo is not installed: worlds of the rigid-body engine are left out")
    of_engine = engine._drive(BUS, NOTHING, {}, START_RAD_S, TORQUE_NM)
    np.testing.assert_allclose(of_engine, drive(LINE, START_RAD_S, TORQUE_NM), atol=0.05)  # at most the sensor's noise


def test_every_effect_of_the_engine_moves_its_line() -> None:
    pytest.importorskip("mujoco", reason="MuJoCo is not installed: worlds of the rigid-body engine are left out")
    torque_nm = np.where(np.arange(3000) % 300 < 150, 500.0, -450.0)
    plain = engine._drive(BUS, NOTHING, {}, 10.0, torque_nm)
    for name, draw in engine.EFFECTS.items():
        changed = engine._drive(BUS, name, draw(np.random.default_rng(1), BUS), 10.0, torque_nm)
        assert (np.std(changed - plain) > 0.05) == (name != NOTHING), name


@pytest.mark.parametrize("name", [name for name in FORMS if name != "linear"])
def test_each_form_is_seen_above_the_noise_and_says_what_it_hides(name: str) -> None:
    case, plain = make_form(name, 1), make_form("linear", 1)
    pairs = zip(case.recordings, plain.recordings, strict=True)
    assert max(np.std(one.speed_true_rad_s - other.speed_true_rad_s) for one, other in pairs) > 0.1
    assert case.specimen.effect in {*worlds.KINDS}
    assert all(np.isfinite(recording.speed_rad_s).all() for recording in case.recordings)


def test_every_kind_of_law_has_a_form_to_calibrate_on_and_another_to_judge_on() -> None:
    laws = {name.split("_")[0] for name in FORMS if "_" in name}
    for law in laws:
        assert {form.role for name, form in FORMS.items() if name.startswith(law)} == set(Role)
    assert not set(parse_forms("calibrate")) & set(parse_forms("judge"))
    assert set(parse_forms("all")) == set(ALL)
    assert parse_forms("engine,judge")[0] == "engine"
    with pytest.raises(argparse.ArgumentTypeError, match="got 'rust'"):
        parse_forms("engine,rust")


def _named(name: str, probability: float | None, is_there: bool, is_strong: bool = False) -> Row:
    return {"name": name, "probability": probability, "alike": [], "is_there": is_there, "is_strong": is_strong}


def _row(form: str, strong: str, *names: Row, verdict: str = "explained") -> Row:
    return {"form": form, "seed": 1, "outputs": 1, "strong": strong, "verdict": verdict, "names": names, "cpu_s": 5.0}


ROWS = [
    _row("engine", "backlash", _named("backlash", 0.9995, True, True), _named("tyre_slip", 0.95, False)),
    _row("engine", NOTHING, verdict="unexplained"),
    _row("linear", NOTHING, verdict="no_mismatch"),
]


def test_the_table_counts_what_was_named_and_what_is_not_there() -> None:
    lines = table(ROWS).splitlines()
    assert "| engine, 1 | 2 | 1 of 1 | 2 | 1 | 1 | 1 | 1 of 2 | 0 of 0 | 5.0, 5.0 |" in lines
    assert "| linear, 1 | 1 | 0 of 0 | 0 | 0 | 1 | 0 | 0 of 0 | 0 of 0 | 5.0, 5.0 |" in lines
    assert lines[-1].startswith("| **judge** | 2 | 1 of 1 |")


def test_what_is_answered_is_not_answered_again(tmp_path: Path) -> None:
    asked: list[str] = []

    def work(name: str) -> Row:
        asked.append(name)
        return {"form": name}

    assert continued(tmp_path / "rows.jsonl", ["a", "b"], work) == [{"form": "a"}, {"form": "b"}]
    assert continued(tmp_path / "rows.jsonl", ["b", "c", "a"], work) == [{"form": "b"}, {"form": "c"}, {"form": "a"}]
    assert asked == ["a", "b", "c"]


@pytest.mark.parametrize("tolerance", [0.0, 0.2])
def test_what_is_known_is_read_as_it_was_stated(tmp_path: Path, tolerance: float) -> None:
    line = 'schema = "hil.model/1"\nstructure = "one_mass"\n[parameters]\nJ_M = { value = 1, tolerance = 0.2 }\n'
    known = worlds._stated("actuator_lag", {"time_constant_s": 0.003}, tolerance)
    (tmp_path / "model.toml").write_text(f"{line}b_M = {{ value = 1, tolerance = 0.2 }}\n{known}")
    value = read_model(tmp_path / "model.toml").model.effects["actuator_lag"]["time_constant_s"]
    assert (value.value, value.tolerance) == (0.003, tolerance)
