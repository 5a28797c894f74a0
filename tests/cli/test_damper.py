"""Active damping by the command line: designed, driven on the simulated rig, compared with its prediction, exported."""

import json
from collections.abc import Callable
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from estimator.damper import Timing
from hil.cli.main import run
from hil.config.model_file import read_model
from hil.design.damper import timing_of
from hil.errors import FileProblem, UsageError
from hil.recording.formats import read_table
from tests.cli.bus_model import MODEL
from tests.cli.conftest import EXAMPLE


@pytest.fixture
def given(tmp_path: Path) -> list[str]:
    """A model that is known to 2 %, and a rig whose cruise is slow and leaves room for a damper; as options."""
    (tmp_path / "bus.toml").write_text(MODEL.replace("tolerance = 0.2", "tolerance = 0.02"))
    text = EXAMPLE.read_text().replace("duration_s = 30.0\nspeed_rad_s = 60.0", "duration_s = 12.0\nspeed_rad_s = 2.0")
    (tmp_path / "rig.toml").write_text(text.replace("torque_nm = 500.0", "torque_nm = 430.0"))
    return ["--model", str(tmp_path / "bus.toml"), "--rig", str(tmp_path / "rig.toml"), "--out", str(tmp_path / "out")]


def test_designed_driven_measured_and_exported(
    given: list[str], simulate: Callable[..., Any], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["design", "damper", *given, "--json"]) == 0
    design = json.loads(capsys.readouterr().out)
    assert design["least_damping"] >= 0.3 > 0.1 > design["before"]["damping"]
    assert design["sensitivity"] <= 2.0
    assert design["torque_nm"] <= design["rig"]["limit_nm"] == 120.0
    assert (tmp_path / "out" / "damper.png").read_bytes().startswith(b"\x89PNG")

    file, simulation = str(tmp_path / "out" / "damper.toml"), simulate(tmp_path / "rig.toml")
    command = ["run", str(tmp_path / "rig.toml"), "cruise", "--damper", file, "--out", str(tmp_path / "on.csv")]
    assert run([*command, "--pace", "fast", *simulation.addresses, "--json"]) == 0
    damper = json.loads(capsys.readouterr().out)["damper"]
    assert damper["off"] is None
    assert damper["expected"] == design["after"]
    assert damper["measured"]["damping"]["value"] == pytest.approx(design["after"]["damping"], rel=0.1)
    assert read_table(tmp_path / "on.csv").metadata["damper"] == "damper.toml"
    assert timing_of(read_model(tmp_path / "bus.toml").model, 0.01, tmp_path / "on.csv", print) == Timing(0.01, 0.01)
    for suffix, said in ((".st", "FUNCTION_BLOCK FB_HilDamper"), (".c", "double hil_damper_torque(")):
        assert run(["export", "damper", file, "--out", str(tmp_path / f"damper{suffix}")]) == 0
        assert said in (tmp_path / f"damper{suffix}").read_text()


def write_estimate(path: Path, half_width: float) -> list[str]:
    k = {"nominal": 4200.0, "value": 4000.0, "ci95": [4000.0 - half_width, 4000.0 + half_width], "unit": "Nm/rad"}
    path.write_text(json.dumps({"schema": "hil.diagnosis/1", "parameters": {"k": k, "T_0": {**k, "ci95": None}}}))
    return ["--estimate", str(path)]


def test_the_estimates_region_replaces_the_tolerance(
    given: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    less = ["--target", "0.2"]
    assert run(["design", "damper", *given, *write_estimate(tmp_path / "diagnosis.json", 20.0), *less, "--json"]) == 0
    design = json.loads(capsys.readouterr().out)
    assert 0.2 <= design["least_damping"] < 0.3
    assert design["line"]["k"] == 4000.0
    assert design["intervals"]["k"] == pytest.approx([3980.0, 4020.0], rel=1e-6)
    high = 4020.0 / (0.98 * 1.6)  # one parameter: its own interval is the region
    expected_hz = np.sqrt(high + 4020.0 / (0.98 * 100.0)) / (2.0 * np.pi)
    assert design["region_hz"][1] == pytest.approx(expected_hz, rel=0.002)


def test_the_dead_time_is_measured_where_the_torque_changes(tmp_path: Path) -> None:
    (tmp_path / "bus.toml").write_text(f"{MODEL}\n[effects.actuator_lag]\ntime_constant_s = {{ value = 0.004 }}\n")
    model = read_model(tmp_path / "bus.toml").model
    torque = np.repeat(np.random.default_rng(1).choice([-60.0, 60.0], 100), 4)
    columns = [0.01 * np.arange(torque.size), torque, *2 * [0.5 * np.roll(torque, 2)]]
    for path, changes in ((tmp_path / "run.csv", 1.0), (tmp_path / "still.csv", 0.0)):
        columns[1] = changes * torque
        header = "time_s,torque_ref_nm,torque_m1_nm,torque_m2_nm"
        np.savetxt(
            path, np.column_stack([*columns, columns[0]]), header=f"{header},speed_rad_s", delimiter=",", comments=""
        )
    assert timing_of(model, 0.01, tmp_path / "run.csv", print) == Timing(0.01, pytest.approx(0.03), 0.004)
    with pytest.raises(UsageError, match=r"still.csv: expected a torque that changes, .* a change of 0 Nm"):
        timing_of(model, 0.01, tmp_path / "still.csv", print)
    with pytest.raises(UsageError, match=r"a row every 0.02 s, .*, got a row every 0.01 s"):
        timing_of(model, 0.02, tmp_path / "run.csv", print)


def test_the_dead_time_that_a_stop_proof_counted_is_designed_for_with_a_cycle_more(tmp_path: Path) -> None:
    (tmp_path / "bus.toml").write_text(MODEL)
    model, proof = read_model(tmp_path / "bus.toml").model, tmp_path / "proof.json"
    devices = [{"name": "can"}, {"name": "m1", "dead_cycles": 1}, {"name": "m2", "dead_cycles": 2}]
    proof.write_text(json.dumps({"schema": "hil.check/1", "devices": devices}))
    assert timing_of(model, 0.01, None, print, proof) == Timing(0.01, pytest.approx(0.03))
    proof.write_text(json.dumps({"schema": "hil.check/1", "devices": devices[:2]}))
    with pytest.raises(FileProblem, match=r"expected dead_cycles of both drives, .* got those of 1"):
        timing_of(model, 0.01, None, print, proof)


@pytest.mark.parametrize(
    ("estimate", "rig", "model", "said"),
    [
        (5000.0, "", "", "diagnosis.json: k is known too little"),
        (inf, "", "", "diagnosis.json: parameters | expected intervals of some of J_M"),
        (None, "amplitude_nm = 120.0|amplitude_nm = 240.0", "", "the PRBS takes all of guard.prbs_limit_nm"),
        (None, "", "rotation|translation", "structure | expected a rotating two_mass line"),
        (None, "", "\n[effects.backlash]\ngap_rad = { value = 0.02 }\n", "effects.backlash | expected a line that is"),
    ],
)
def test_what_there_is_no_design_for_is_refused(
    given: list[str],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    estimate: float | None,
    rig: str,
    model: str,
    said: str,
) -> None:
    for name, change in (("rig.toml", rig), ("bus.toml", model)):
        text = (tmp_path / name).read_text()
        old, bar, new = change.partition("|")
        (tmp_path / name).write_text(text.replace(old, new) if bar else text + change)
    extra = [] if estimate is None else write_estimate(tmp_path / "diagnosis.json", estimate)
    assert run(["design", "damper", *given, *extra]) == 2
    assert said in capsys.readouterr().err


def test_a_design_without_a_rig_is_not_said_to_be_driven(
    given: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "diagnosis.json").write_text('{"schema": "hil.diagnosis/1", "parameters": {"k": 5}}')
    assert run(["design", "damper", *given[:2], *given[4:], "--estimate", str(tmp_path / "diagnosis.json")]) == 2
    assert "expected intervals" in capsys.readouterr().err
    assert run(["design", "damper", *given[:2], *given[4:]]) == 0
    assert "damper.toml: needs --rig to be driven" in capsys.readouterr().out
