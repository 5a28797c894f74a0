"""The command that writes a case as files."""

import json
import tomllib

import numpy as np
import pytest

from hil.proof.make_case import main
from hil.proof.truth.specimen import draw_specimen
from hil.recording import read_record


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    out = tmp_path_factory.mktemp("case") / "new"
    assert main(["--effect", "backlash", "--seed", "4", "--out", str(out)]) == 0
    return out


def test_the_tool_gets_recordings_and_a_nominal_model(folder):
    assert sorted(path.name for path in (folder / "case").iterdir()) == [
        "model.toml",
        "run_1.csv",
        "run_2.csv",
        "run_3.csv",
    ]
    model = tomllib.loads((folder / "case" / "model.toml").read_text())
    assert model["schema"] == "hil.model/1"
    assert model["structure"] == "two_mass"
    assert set(model["parameters"]) == {"J_M", "J_L", "k", "c", "b_M", "b_L"}
    assert all(entry["tolerance"] == 0.2 for entry in model["parameters"].values())
    table = np.genfromtxt(folder / "case" / "run_1.csv", delimiter=",", names=True)
    assert table.dtype.names == ("time_s", "torque_ref_nm", "torque_m1_nm", "torque_m2_nm", "speed_rad_s")
    np.testing.assert_allclose(table["time_s"], np.arange(3000) * 0.01)


def test_the_judge_gets_the_truth_and_fresh_recordings(folder):
    truth = json.loads((folder / "sealed" / "truth.json").read_text())
    assert truth["effect"] == "backlash"
    assert truth["element"] == ["shaft"]
    assert 0.004 <= truth["hidden"]["backlash"]["gap_rad"] <= 0.04
    seen = np.genfromtxt(folder / "case" / "run_1.csv", delimiter=",", names=True)
    fresh = np.genfromtxt(folder / "sealed" / "fresh_1.csv", delimiter=",", names=True)
    assert not np.array_equal(seen["torque_ref_nm"], fresh["torque_ref_nm"])


def test_lost_samples_are_written_as_nan_with_a_column_of_flags(tmp_path):
    specimens = (draw_specimen("lost_samples", seed) for seed in range(50))
    seed = next(s.seed for s in specimens if s.sizes["lost_samples"]["m2"] and not s.sizes["lost_samples"]["as_zero"])
    assert main(["--effect", "lost_samples", "--seed", str(seed), "--out", str(tmp_path)]) == 0
    table = np.genfromtxt(tmp_path / "case" / "run_1.csv", delimiter=",", names=True)
    assert table.dtype.names[-1] == "flags"
    assert table.size == 3000
    lost = np.isnan(table["torque_m2_nm"])
    assert lost.any()
    assert np.all(table["flags"][lost] > 0)
    assert read_record(tmp_path / "case" / "run_1.csv").okay.sum() == np.count_nonzero(table["flags"] == 0)
