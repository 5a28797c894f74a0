"""Real recordings from question to ``real.json``; the tool itself is replaced by one that answers at once."""

import json
from pathlib import Path

import numpy as np
import pytest

from estimator.physics.catalogue import EFFECTS
from hil.config.model_file import read_model_for_recordings
from hil.proof import real
from hil.proof.command import CommandFailed
from hil.proof.real import agreement, read_real, run_real
from hil.proof.real_files import (
    KnownValue,
    RealFileError,
    known_cases,
    read_case,
    read_truth,
    write_shown,
)
from hil.recording.formats import read_table
from tests.proof import made_up_recording as made_up

CASES = known_cases()

DIAGNOSIS = {
    "verdict": "explained",
    "statement": "drag is missing",
    "effects": [
        {
            "name": "aerodynamic_drag",
            "parameters": {"drag_nm_s2": {"value": 0.52, "ci95": [0.45, 0.6], "unit": "N s^2/m^2"}},
        }
    ],
    "parameters": {"J_M": {"value": 100.0, "ci95": [99.0, 101.0]}},
    "load_torque": {"first": {"value": 1.0, "ci95": [None, None]}},
    "fit": {"unit": "m/s", "holdout_retuned": 0.5, "holdout_augmented": 0.1},
}


class Tool:
    """Stands for the command line: keeps what it was shown, answers always the same."""

    def __init__(self):
        self.seen = []

    def __call__(self, arguments, folder, limit_s):
        place = Path(folder).parent
        self.seen.append((list(arguments), {path.name: path.read_bytes() for path in place.rglob("*.[ct]*")}))
        (place / "out" / "diagnosis.json").write_text(json.dumps(DIAGNOSIS))
        (place / "out" / "report.html").write_text("a report")


@pytest.fixture
def tool(monkeypatch):
    tool = Tool()
    monkeypatch.setattr(real, "run_hil", tool)
    return tool


@pytest.fixture
def world(tmp_path):
    room, data = tmp_path / "room", tmp_path / "data"
    made_up.write_case(room, data)
    return room, data, tmp_path / "out"


def run(world, **more):
    room, data, out = world
    return run_real(data, out, room=room, **more)


def test_the_tool_sees_shown_channels_and_the_nominal_model_and_nothing_else(tool, world):
    run(world)
    ((arguments, files),) = tool.seen
    assert arguments == [
        *("diagnose", "first.csv", "--model", "model.toml", "--out", "../out"),
        *("--holdout", "second.csv"),
    ]
    assert set(files) == {"first.csv", "second.csv", "model.toml"}
    assert files["first.csv"].startswith(b"t,force,speed\n")
    assert b"aerodynamic_drag" not in b"".join(files.values())


def test_what_was_found_is_compared_with_what_is_known(tool, world):
    *_, out = world
    (case,) = run(world)
    (only,) = case["runs"]
    assert case["named_right"]
    assert only["held_out"] == {"before": 0.5, "after": 0.1}
    (drag,) = only["agreements"]
    assert (drag["found"], drag["inside"], drag["within"]) == (0.52, True, True)
    assert (out / only["report"]).read_text() == "a report"
    assert read_real(out) == json.loads(json.dumps([case]))


def test_a_command_that_fails_is_a_result_and_is_tried_again(tool, world, monkeypatch):
    def broken(arguments, folder, limit_s):
        raise CommandFailed("hil diagnose: ended with status 3")

    reported = []
    monkeypatch.setattr(real, "run_hil", broken)
    (case,) = run(world, progress=lambda *what: reported.append(what))
    assert case["runs"][0]["fault"] == "hil diagnose: ended with status 3"
    assert not case["named_right"]
    assert reported == [("trolley/only diagnosed", 1, 1)]
    monkeypatch.setattr(real, "run_hil", tool)
    assert run(world)[0]["runs"][0]["fault"] is None


KNOWN = KnownValue(what="drag", found="effects.aerodynamic_drag.drag_nm_s2", value=0.5, unit="x", within=0.1)


@pytest.mark.parametrize(
    ("place", "found", "inside", "within"),
    [
        ("effects.aerodynamic_drag.drag_nm_s2", 0.52, True, True),
        ("effects.backlash.gap_rad", None, None, False),
        ("parameters.J_M", 100.0, False, False),
        ("parameters.k", None, None, False),
        ("load_torque", 1.0, None, False),
    ],
)
def test_a_known_value_is_sought_where_the_diagnosis_has_it(place, found, inside, within):
    got = agreement(KNOWN.model_copy(update={"found": place}), DIAGNOSIS)
    assert (got.found, got.inside, got.within) == (found, inside, within)


@pytest.mark.parametrize("name", CASES)
def test_a_shipped_case_is_whole(name):
    folder = CASES[name]
    case, model = read_case(folder), read_model_for_recordings(folder / "model.toml")
    assert (folder / "provenance.md").read_text().startswith("# ")
    assert set(case.concealed) <= set(EFFECTS)
    assert not set(case.concealed) & set(model.model.effects), "what is concealed is not in the nominal model"
    assert model.signals is not None
    output = model.signals.output()[1].column
    used = {output, *(torque.column for torque in model.signals.torques()), *(m.column for m in model.signals.mask)}
    assert used <= set(case.shown), "the model file reads shown channels only"


@pytest.mark.parametrize("name", CASES)
def test_nothing_the_tool_is_given_tells_the_truth(name):
    """Of a case's folder the model file alone goes into the neutral place: no known value may be written in it."""
    reported = (CASES[name] / "model.toml").read_text()
    for known in read_truth(CASES[name]).values:
        assert f"{known.value:g}" not in reported or known.found.split(".")[1] not in read_case(CASES[name]).concealed


@pytest.mark.parametrize(
    ("before", "after", "reported"),
    [
        ('withheld = ["secret"]', 'withheld = ["speed"]', "withheld | expected channels that are not shown"),
        ('fit = ["first"]', 'fit = ["third"]', "runs.0 | expected names of [recordings] (first, second)"),
        ('held_out = ["second"]', 'held_out = ["first"]', "runs.0.held_out | expected recordings that are not fitted"),
        ('conceals = "drag"', 'conceals = "drag"\nx = 1', "x | expected one of the known keys"),
        ('path = "trolley/a.csv"', 'path = "/etc/passwd"', "recordings.first.path"),
        ('sha256 = "{a}"', 'sha256 = "123"', "recordings.first.sha256"),
        ("[[runs]]", '[[runs]]\nname = "only"\nfit = ["second"]\n\n[[runs]]', "runs | expected a name of its own"),
    ],
)
def test_a_wrong_case_file_is_refused_by_key(tmp_path, before, after, reported):
    folder = made_up.write_case(tmp_path / "room", tmp_path / "data", case=made_up.CASE.replace(before, after))
    with pytest.raises(RealFileError) as caught:
        read_case(folder)
    assert reported in str(caught.value)


def test_a_recording_is_cut_to_its_rows_and_shown_channels_to_the_last_bit(tmp_path):
    text = made_up.CASE.replace('path = "trolley/a.csv"', 'path = "trolley/a.csv"\nrows = [100, 150]')
    case = read_case(made_up.write_case(tmp_path / "room", tmp_path / "data", case=text))
    shown = read_table(write_shown(case, "first", tmp_path / "data", tmp_path))
    original = read_table(tmp_path / "data" / "trolley" / "a.csv")
    assert list(shown.columns) == ["t", "force", "speed"]
    for name, values in shown.columns.items():
        np.testing.assert_array_equal(values, original.columns[name][100:150])


def test_another_recording_than_was_meant_none_and_a_missing_channel_are_refused(world):
    room, data, out = world
    path, case = data / "trolley" / "a.csv", read_case(room / "trolley")
    with pytest.raises(RealFileError, match="pedal"):
        write_shown(case.model_copy(update={"shown": ["t", "pedal"]}), "first", data, out)
    path.write_text(path.read_text().replace("speed", "Speed"))
    with pytest.raises(RealFileError, match=r"expected the SHA-256 [0-9a-f]{64}, got"):
        write_shown(case, "first", data, out)
    path.unlink()
    with pytest.raises(RealFileError, match=r"(?s)got nothing.*https://example\.org/trolley"):
        write_shown(case, "first", data, out)
