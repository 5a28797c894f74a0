"""The folders of real recordings: what is shipped is whole and hides what it says; what is wrong is refused."""

import pytest

from estimator.physics.catalogue import EFFECTS
from hil.config.model_file import read_model_for_recordings
from hil.errors import UsageError
from hil.proof.real.case_file import RealFileError, case_folders, known_cases, read_case
from hil.proof.real.truth_file import read_truth
from tests.proof.real import made_up

CASES = known_cases()


def test_the_recordings_that_were_asked_for_are_there():
    assert {"emps", "car_grade", "car_drag", "friction_joint"} <= set(CASES)
    assert any(not read_case(folder).concealed for folder in CASES.values()), "one in which nothing is to be found"


@pytest.mark.parametrize("name", CASES)
def test_a_shipped_case_is_whole(name):
    folder = CASES[name]
    case, truth, model = read_case(folder), read_truth(folder), read_model_for_recordings(folder / "model.toml")
    assert (folder / "provenance.md").read_text().startswith("# ")
    assert set(case.concealed) <= set(EFFECTS)
    assert not set(case.concealed) & set(model.model.effects), "what is concealed is not in the nominal model"
    assert model.signals is not None
    output = model.signals.output()[1].column
    used = {output, *(torque.column for torque in model.signals.torques()), *(m.column for m in model.signals.mask)}
    assert used <= set(case.shown), "the model file reads shown channels only"
    recordings = {recording for goal in truth.goals for recording in goal.recordings}
    assert recordings <= {held for run in case.runs for held in (*run.fit, *run.held_out)}
    if truth.grade is not None:
        assert truth.grade.acceleration.column in case.withheld


@pytest.mark.parametrize("name", CASES)
def test_nothing_the_tool_is_given_tells_the_truth(name):
    """Of a case's folder the model file alone goes into the neutral place: no known value may be written in it."""
    reported = (CASES[name] / "model.toml").read_text()
    for known in read_truth(CASES[name]).values:
        assert f"{known.value:g}" not in reported or known.found.split(".")[1] not in read_case(CASES[name]).concealed


def refused(tmp_path, before, after):
    folder = made_up.write_case(tmp_path / "room", tmp_path / "data", case=made_up.CASE.replace(before, after))
    with pytest.raises(RealFileError) as caught:
        read_case(folder)
    return str(caught.value)


@pytest.mark.parametrize(
    ("before", "after", "reported"),
    [
        ('withheld = ["secret"]', 'withheld = ["speed"]', "withheld | expected channels that are not shown"),
        ('fit = ["first"]', 'fit = ["third"]', "runs.0 | expected names of [recordings] (first, second)"),
        ('held_out = ["second"]', 'held_out = ["first"]', "runs.0.held_out | expected recordings that are not fitted"),
        ('measure = "rms"', 'measure = "mean"', "measure | expected"),
        ('measure = "rms"', 'measure = "nrmse"\nx = 1', "x | expected one of the known keys"),
        ('path = "trolley/a.csv"', 'path = "/etc/passwd"', "recordings.first.path"),
        ('sha256 = "{a}"', 'sha256 = "123"', "recordings.first.sha256"),
    ],
)
def test_a_wrong_case_file_is_refused_by_key(tmp_path, before, after, reported):
    assert reported in refused(tmp_path, before, after)


def test_two_runs_need_two_names(tmp_path):
    again = '\n[[runs]]\nname = "only"\nfit = ["second"]\n'
    assert "runs | expected a name of its own for each" in refused(tmp_path, made_up.CASE, made_up.CASE + again)


def test_a_measure_against_a_spread_needs_recordings_held_out(tmp_path):
    case = made_up.CASE.replace('measure = "rms"', 'measure = "nrmse"').replace('held_out = ["second"]', "")
    assert "runs.0.held_out | expected recordings" in refused(tmp_path, made_up.CASE, case)


def test_an_unknown_case_is_refused(tmp_path):
    made_up.write_case(tmp_path / "room", tmp_path / "data")
    with pytest.raises(UsageError, match=r"glider: expected names of real recordings \(trolley\)"):
        case_folders(["glider"], tmp_path / "room")


def test_a_wrong_truth_file_is_refused(tmp_path):
    folder = made_up.write_case(tmp_path / "room", tmp_path / "data")
    (folder / "truth.toml").write_text(made_up.TRUTH.replace("effects.aerodynamic_drag.drag_nm_s2", "the drag"))
    with pytest.raises(RealFileError, match=r"values.0.found \| expected"):
        read_truth(folder)
