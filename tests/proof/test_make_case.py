"""The command that writes a case as files."""

import json
import tomllib

import numpy as np
import pytest

from hil.proof.make_case import main


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


def test_nothing_of_it_tells_what_is_hidden(folder):
    for path in (folder / "case").iterdir():
        assert "backlash" not in path.read_text()
        assert "gap" not in path.read_text()


def test_the_judge_gets_the_truth_and_fresh_recordings(folder):
    truth = json.loads((folder / "sealed" / "truth.json").read_text())
    assert truth["effect"] == "backlash"
    assert truth["element"] == ["shaft"]
    assert 0.004 <= truth["hidden"]["backlash"]["gap_rad"] <= 0.04
    seen = np.genfromtxt(folder / "case" / "run_1.csv", delimiter=",", names=True)
    fresh = np.genfromtxt(folder / "sealed" / "fresh_1.csv", delimiter=",", names=True)
    assert not np.array_equal(seen["torque_ref_nm"], fresh["torque_ref_nm"])


def test_an_unknown_effect_is_wrong_use(tmp_path, capsys):
    with pytest.raises(SystemExit) as exit_:
        main(["--effect", "rust", "--seed", "1", "--out", str(tmp_path / "out")])
    assert exit_.value.code == 2
    assert "effect 'rust': expected one of" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
