"""Real recordings from question to ``real.json``; the tool itself is replaced by one that answers at once."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hil.proof.command import CommandFailed
from hil.proof.real import ask, one_run
from hil.proof.real import run as real
from hil.proof.real.case_file import RealFileError
from hil.proof.real.judge import Agreement, goal_agreement, median_agreement, value_agreement
from hil.proof.real.result import Errors, RealResult, RunResult, read_results, to_json
from hil.proof.real.run import main, run_real
from hil.proof.real.truth_file import Goal, KnownValue
from tests.proof.real import made_up

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

ERROR_M_S = {"retuned": 0.3, "augmented": 0.04}
"""By how much the stand-in's simulations are off."""


class Tool:
    """Stands for the command line: keeps what it was shown, answers always the same."""

    def __init__(self):
        self.seen = []

    def __call__(self, arguments, folder, limit_s):
        place = Path(folder).parent
        self.seen.append((list(arguments), {path.name: path.read_bytes() for path in place.rglob("*.[ct]*")}))
        out = place / "out"
        if arguments[0] == "diagnose":
            out.mkdir()
            (out / "diagnosis.json").write_text(json.dumps(DIAGNOSIS))
            model = (Path(folder) / "model.toml").read_text()
            (out / "augmented.toml").write_text(model + made_up.WITH_DRAG)
            (out / "report.html").write_text("a report")
        else:
            model, recording, result = arguments[2], arguments[4], arguments[6]
            assert (Path(folder) / model).exists()
            recorded = np.genfromtxt(Path(folder) / recording, delimiter=",", names=True)
            off = ERROR_M_S[Path(model).stem]
            table = np.column_stack([recorded["t"], recorded["speed"] + off])
            np.savetxt(Path(folder) / result, table, delimiter=",", header="time_s,speed_sim_m_s", comments="")


@pytest.fixture
def tool(monkeypatch):
    tool = Tool()
    monkeypatch.setattr(ask, "run_hil", tool)
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
    arguments, files = tool.seen[0]
    assert arguments == ["diagnose", "first.csv", "--model", "model.toml", "--out", "../out"]
    assert set(files) == {"first.csv", "model.toml"}
    assert files["first.csv"].startswith(b"t,force,speed\n")
    assert b"aerodynamic_drag" not in b"".join(files.values())


def test_the_truth_is_read_when_the_tool_has_answered(tool, world, monkeypatch):
    read, commands = [], []
    monkeypatch.setattr(
        one_run, "read_truth", lambda folder, true=one_run.read_truth: read.append(len(tool.seen)) or true(folder)
    )
    run(world)
    commands = [arguments[0] for arguments, _ in tool.seen]
    assert commands == ["diagnose", *["simulate"] * 4]
    assert read == [len(commands)]
    assert not any("truth.toml" in files for _, files in tool.seen)


def test_errors_before_and_after_agreements_and_black_boxes(tool, world):
    (result,) = run(world)
    (only,) = result.runs
    assert result.named_right
    assert only.held_out.before == pytest.approx({"second": ERROR_M_S["retuned"]})
    assert only.held_out.after == pytest.approx({"second": ERROR_M_S["augmented"]})
    drag, goal = only.agreements
    assert (drag.found, drag.inside, drag.within) == (0.52, True, True)
    assert goal.within
    linear, _ = only.black_boxes
    assert 0.0 < linear.held_out["second"] < 4.0


def test_paths_lead_from_the_result_to_diagnosis_and_report(tool, world):
    *_, out = world
    (result,) = run(world)
    assert (out / result.runs[0].diagnosis).is_file()
    assert (out / result.runs[0].report).read_text() == "a report"


def test_the_file_is_what_was_returned(tool, world):
    *_, out = world
    results = run(world)
    assert json.loads((out / "real.json").read_text())["schema"] == "hil.real/1"
    (kept,) = read_results(out / "real.json")
    assert kept.runs[0].held_out.after == pytest.approx(results[0].runs[0].held_out.after)
    assert to_json([kept]) == to_json(results)


def test_a_case_that_is_done_is_not_run_again_until_its_files_change(tool, world):
    room, *_ = world
    run(world)
    asked = len(tool.seen)
    run(world)
    assert len(tool.seen) == asked
    model = room / "trolley" / "model.toml"
    model.write_text(model.read_text().replace("value = 8.0", "value = 7.0"))
    run(world)
    assert len(tool.seen) == 2 * asked


def test_another_truth_is_judged_anew_without_asking_again(tool, world):
    room, *_ = world
    run(world)
    truth = room / "trolley" / "truth.toml"
    truth.write_text(truth.read_text().replace("at_most = 0.05", "at_most = 0.01"))
    (result,) = run(world)
    assert [arguments[0] for arguments, _ in tool.seen].count("diagnose") == 1
    assert not result.runs[0].agreements[1].within


def test_a_command_that_fails_is_a_result_and_is_tried_again(tool, world, monkeypatch):
    def broken(arguments, folder, limit_s):
        raise CommandFailed("hil diagnose: ended with status 3")

    reported = []
    monkeypatch.setattr(ask, "run_hil", broken)
    (result,) = run(world, progress=lambda message, share: reported.append((message, share)))
    assert result.runs[0].fault == "hil diagnose: ended with status 3"
    assert not result.named_right
    assert reported == [("trolley only: failed, hil diagnose: ended with status 3", 1.0)]
    monkeypatch.setattr(ask, "run_hil", tool)
    assert run(world)[0].runs[0].fault is None


def test_held_out_blocks_are_hidden_where_a_course_is_estimated(tool, tmp_path):
    case = made_up.CASE.replace('judged = "everywhere"', 'judged = "blocks"')
    made_up.write_case(tmp_path / "room", tmp_path / "data", case=case)
    with pytest.raises(AssertionError):  # the stand-in answers with what it read: nothing, in the blocks
        np.testing.assert_array_less(_held_out(tool, tmp_path), np.inf)
    shown = next(files for arguments, files in tool.seen if "second.csv" in arguments)
    speed = np.genfromtxt(shown["second.csv"].decode().splitlines(), delimiter=",", names=True)["speed"]
    hidden = np.isnan(speed).reshape(-1, 20)  # 0.6 s in the middle of every 2 s; the edges are rounded
    assert hidden[:, 8:13].all()
    assert not hidden[:, :7].any()
    assert not hidden[:, 13:].any()


def _held_out(tool, tmp_path):
    (result,) = run_real(tmp_path / "data", tmp_path / "out", room=tmp_path / "room")
    return list(result.runs[0].held_out.after.values())


def test_without_recordings_held_out_the_diagnosis_own_blocks_count(tool, tmp_path):
    case = made_up.CASE.replace('held_out = ["second"]', "")
    made_up.write_case(tmp_path / "room", tmp_path / "data", case=case)
    (result,) = run_real(tmp_path / "data", tmp_path / "out", room=tmp_path / "room")
    held_out = result.runs[0].held_out
    assert (held_out.before, held_out.after) == ({"blocks kept out": 0.5}, {"blocks kept out": 0.1})
    assert set(result.runs[0].black_boxes[0].held_out) == {"first"}


def test_a_course_is_held_against_the_withheld_channel(tool, tmp_path, monkeypatch):
    """The stand-in's free run is under the true drag; the channel that tells it is the drag: they correlate."""
    folder = made_up.write_case(tmp_path / "room", tmp_path / "data")
    (folder / "truth.toml").write_text(
        made_up.TRUTH
        + '[grade]\neffect = "aerodynamic_drag"\nacceleration = { column = "secret" }\n'
        + 'speed = { column = "speed", scale = 0.0 }\nlow_pass_hz = 0.1\ncorrelation = 0.8\n'
    )
    monkeypatch.setitem(ERROR_M_S, "augmented", 0.0)
    real_read = ask.read_model
    monkeypatch.setattr(ask, "read_model", lambda path: _without_effects(real_read(path)))
    (result,) = run_real(tmp_path / "data", tmp_path / "out", room=tmp_path / "room")
    assert result.runs[0].grade_correlation > 0.99
    assert result.agreements[0].within


def _without_effects(file):
    return replace(file, model=replace(file.model, effects={}))


def test_a_missing_recording_stops_everything_before_anything_is_run(tool, world):
    _, data, _ = world
    (data / "trolley" / "b.csv").unlink()
    with pytest.raises(RealFileError, match="expected a recording"):
        run(world)
    assert tool.seen == []


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
    got = value_agreement(KNOWN.model_copy(update={"found": place}), DIAGNOSIS)
    assert (got.found, got.inside, got.within) == (found, inside, within)


def test_a_value_of_several_recordings_is_no_one_value():
    loads = {"load_torque": {"a": {"value": 1.0}, "b": {"value": 2.0}}}
    assert value_agreement(KNOWN.model_copy(update={"found": "load_torque"}), DIAGNOSIS | loads).found is None


def test_a_place_that_no_file_can_name_is_refused():
    with pytest.raises(ValueError, match="expected parameters"):
        value_agreement(KNOWN.model_copy(update={"found": "warnings"}), DIAGNOSIS)


def test_a_goal_is_for_the_median_of_the_recordings_that_count():
    goal = Goal(what="error", on="held_out", at_most=0.2, recordings=["a", "b", "c"])
    assert goal_agreement(goal, {"a": 0.1, "b": 0.15, "c": 9.0, "d": 9.0}, "N").found == 0.15
    assert not goal_agreement(goal, {"d": 0.1}, "N").within


def test_a_run_that_found_no_course_counts_as_none():
    assert median_agreement("course", "", [0.9, None, 0.95], 0.85).found == pytest.approx(0.9)
    assert not median_agreement("course", "", [0.9, None, None], 0.85).within
    assert median_agreement("course", "", [None], 0.85).found is None


def test_an_endless_error_is_written_and_read_back(tmp_path):
    lost = RunResult("only", held_out=Errors({"a": 1.0}, {"a": float("inf")}))
    agreement = Agreement("x", "m", 1.0, 2.0, (0.5, 3.0), True, False, "within")
    result = RealResult("trolley", "t", ("backlash",), "a gap", "rms", (lost,), (agreement,))
    path = tmp_path / "real.json"
    path.write_text(to_json([result]))
    assert read_results(path) == [replace(result, runs=(replace(lost),), agreements=(agreement,))]


def test_a_result_of_another_schema_is_refused(tmp_path):
    (tmp_path / "real.json").write_text('{"schema": "hil.real/0", "cases": []}')
    with pytest.raises(ValueError, match=r"expected the schema hil\.real/1"):
        read_results(tmp_path / "real.json")


def test_the_command_writes_the_file_and_refuses_what_it_can_not_do(tool, world, monkeypatch, capsys):
    room, data, out = world
    monkeypatch.delenv("HIL_DATA", raising=False)
    monkeypatch.setattr(real, "run_real", lambda *args, **more: run_real(*args, **more, room=room))
    assert main(["--data", str(data), "--out", str(out)]) == 0
    assert "[100%] trolley only: explained (aerodynamic_drag)" in capsys.readouterr().out
    for arguments in (["glider", "--data", str(data)], [], ["--data", str(data), "--jobs", "0"]):
        with pytest.raises(SystemExit, match="2"):
            main([*arguments, "--out", str(out)])


def test_interrupted_it_ends_with_130_and_keeps_what_is_done(tool, world, monkeypatch):
    *_, data, out = world

    def interrupted(*_args, **_more):
        raise KeyboardInterrupt

    monkeypatch.setattr(real, "run_real", interrupted)
    assert main(["--data", str(data), "--out", str(out)]) == 130
