"""A campaign from its command to its summary; the tool itself is replaced by one that answers at once."""

import json
import xml.etree.ElementTree as ET
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from hil.proof import fresh
from hil.proof.campaign import case as campaign_case
from hil.proof.campaign import run as campaign
from hil.proof.campaign.case import Answer, run_case
from hil.proof.campaign.kinds import kind
from hil.proof.campaign.matrix import confusion_of, confusion_svg
from hil.proof.campaign.report import markdown, summary
from hil.proof.campaign.statistics import Rate, columns, confusion, coverage
from hil.proof.command import CommandFailed, run_hil
from hil.proof.fresh import rms_over_floor
from hil.proof.own_folder import MARK
from hil.proof.truth.case import make_case

DIAGNOSIS = {
    "verdict": "explained",
    "mismatch": {"element": "shaft"},
    "effects": [{"name": "backlash", "element": "shaft", "indistinguishable_from": [], "time_s": {}, "parameters": {}}],
    "parameters": {},
    "fit": {"noise_floor": 0.05},
}


class Tool:
    """Stands for the command line: keeps what it was shown, answers always the same."""

    def __init__(self, results):
        self.seen = []
        self.truths = []
        self._results = results

    def __call__(self, arguments, folder, limit_s):
        files = {path.name: path.read_text() for path in Path(folder).parent.rglob("*") if path.is_file()}
        self.seen.append((arguments, folder, files))
        self.truths += self._results.rglob("truth.json")
        if arguments[0] == "diagnose":
            out = Path(folder).parent / "out"
            out.mkdir()
            (out / "diagnosis.json").write_text(json.dumps(DIAGNOSIS))
            (out / "augmented.toml").write_text("a model")
        else:
            recorded = np.genfromtxt(Path(folder) / arguments[4], delimiter=",", names=True)
            table = np.column_stack([recorded["time_s"], recorded["speed_rad_s"] + 0.1])
            np.savetxt(Path(folder) / arguments[6], table, delimiter=",", header="time_s,speed_sim_rad_s", comments="")


@pytest.fixture
def tool(monkeypatch, tmp_path, brief):
    tool = Tool(tmp_path)
    for module in (campaign_case, fresh):
        monkeypatch.setattr(module, "run_hil", tool)
    return tool


def test_the_tool_sees_recordings_and_nominal_model_and_nothing_of_the_truth(tool, tmp_path):
    truth, answer = run_case(kind("backlash"), 4, tmp_path / "backlash" / "4", 10.0)
    arguments, folder, files = tool.seen[0]
    assert arguments == ["diagnose", "run_1.csv", "run_2.csv", "run_3.csv", "--model", "model.toml", "--out", "../out"]
    assert set(files) == {"run_1.csv", "run_2.csv", "run_3.csv", "model.toml"}
    assert "backlash" not in str(folder) + "".join(files.values())
    made = sorted(path.name for path in (tmp_path / "backlash" / "4").iterdir())
    assert made == [MARK, "case", "out", "sealed"]
    assert tool.truths == []
    assert (tmp_path / "backlash" / "4" / "sealed" / "truth.json").exists()
    assert truth["effect"] == "backlash"
    assert answer.fresh_over_floor == pytest.approx([2.0, 2.0, 2.0], rel=1e-6)  # 0.1 over 0.05 rad/s
    assert not list(tmp_path.rglob("out/fresh_?.csv"))


def test_a_command_that_fails_ends_its_case_and_no_other(monkeypatch, tmp_path, brief):
    def broken(arguments, folder, limit_s):
        raise CommandFailed("hil diagnose: ended with status 3: no bus")

    monkeypatch.setattr(campaign_case, "run_hil", broken)
    status = campaign.main(["--seeds", "1", "--kinds", "none,off", "--out", str(tmp_path)])
    rows = [json.loads(line) for line in (tmp_path / "results.jsonl").read_text().splitlines()]
    assert status == 0
    assert [row["outcome"] for row in rows] == ["failed", "failed"]
    assert "no bus" in (tmp_path / "summary.md").read_text()


def test_the_real_command_is_run_and_its_failure_is_quoted(tmp_path):
    with pytest.raises(CommandFailed, match=r"hil diagnose: ended with status 2: .*absent.toml"):
        run_hil(["diagnose", "run_1.csv", "--model", "absent.toml", "--out", "out"], tmp_path, 60.0)
    with pytest.raises(CommandFailed, match="took longer than"):
        run_hil(["--help"], tmp_path, 0.01)


def test_a_campaign_continues_where_it_ended_and_repeats_what_failed(tool, tmp_path, capsys):
    arguments = ["--kinds", "backlash,off", "--out", str(tmp_path)]
    assert campaign.main(["--seeds", "1", *arguments]) == 0
    lines = (tmp_path / "results.jsonl").read_text().splitlines()
    assert len(lines) == 2
    failed = {**json.loads(lines[0]), "fault": "hil simulate: ended with status 1"}
    (tmp_path / "results.jsonl").write_text("\n".join([json.dumps(failed), *lines[1:], ""]))
    tool.seen.clear()
    assert campaign.main(["--seeds", "1..2", *arguments]) == 0
    asked = [arguments for arguments, _, _ in tool.seen if arguments[0] == "diagnose"]
    assert len(asked) == 3  # the one that failed, and both of the new seed
    assert "3 cases to run, 1 done before" in capsys.readouterr().out
    data = json.loads((tmp_path / "summary.json").read_text())
    assert data["cases"] == 4
    assert data["groups"]["single"]["success"]["hits"] == 2
    assert data["groups"]["off"]["outcomes"] == {"invented": 2}
    assert data["confusion"] == {"off": {"backlash": 2}, "backlash": {"backlash": 2}}


def test_an_interrupted_campaign_keeps_what_it_has(tool, tmp_path, monkeypatch):
    def interrupted(kind, seed, folder, limit_s):
        if seed == 2:
            raise KeyboardInterrupt
        return run_case(kind, seed, folder, limit_s)

    monkeypatch.setattr(campaign, "run_case", interrupted)
    assert campaign.main(["--seeds", "1..3", "--kinds", "backlash", "--out", str(tmp_path)]) == 130
    assert [json.loads(line)["seed"] for line in (tmp_path / "results.jsonl").read_text().splitlines()] == [1]
    assert json.loads((tmp_path / "summary.json").read_text())["cases"] == 1


def test_a_damaged_results_file_is_refused_with_its_line(tmp_path, capsys):
    (tmp_path / "results.jsonl").write_text('{"kind": "none", "seed": 1}\n{"kind": "no\n')
    with pytest.raises(SystemExit) as exit_:
        campaign.main(["--seeds", "1", "--kinds", "none", "--out", str(tmp_path)])
    assert exit_.value.code == 2
    assert "line 2: expected one case as JSON" in capsys.readouterr().err


@pytest.mark.parametrize(
    "wrong", [["--seeds", "9..1"], ["--seeds", "1", "--kinds", "rust"], ["--seeds", "1", "--jobs", "0"]]
)
def test_wrong_use_is_refused_before_anything_is_made(tmp_path, wrong):
    with pytest.raises(SystemExit) as exit_:
        campaign.main([*wrong, "--out", str(tmp_path / "out")])
    assert exit_.value.code == 2
    assert not (tmp_path / "out").exists()


def test_fresh_errors_leave_out_what_was_lost():
    case = make_case("lost_samples", next(s for s in range(50) if _flags(s)))
    recording = case.fresh[0]
    exact = np.nan_to_num(recording.speed_rad_s)
    exact[recording.flags != 0] += 1e3
    assert rms_over_floor(recording.speed_rad_s, recording.flags, exact) == 0.0


def _flags(seed):
    from hil.proof.truth.specimen import draw_specimen

    return not draw_specimen("lost_samples", seed).sizes["lost_samples"]["as_zero"]


@pytest.mark.parametrize(
    ("hits", "trials", "low", "high"),
    [(0, 10, 0.0, 0.2775), (10, 10, 0.7225, 1.0), (5, 10, 0.2366, 0.7634), (81, 263, 0.2553, 0.3662)],
)
def test_wilson_intervals_are_those_of_the_literature(hits, trials, low, high):
    """R. G. Newcombe, Statistics in Medicine 17 (1998), table I, method 3, for 81 of 263."""
    assert Rate(hits, trials).interval == pytest.approx((low, high), abs=1e-4)
    assert Rate(0, 0).interval == (0.0, 1.0)


def _row(planted, *named, group="single", verdict="explained", **more):
    return {
        "kind": planted,
        "group": group,
        "seed": 1,
        "outcome": "right",
        "success": True,
        "fault": None,
        "diagnose_s": 10.0,
        "fresh_over_floor": [1.1],
        "verdict": verdict,
        "named": list(named),
        "element_right": True,
        "event_iou": {},
        "sizes": [],
        **more,
    }


ROWS = [
    _row("backlash", "backlash"),
    _row("backlash", "stiffness_nonlinearity", outcome="wrong", success=False),
    _row("none", group="none", verdict="no_mismatch", element_right=None),
    _row("speed_stiffened_shaft", group="outside", verdict="unexplained", outcome="abstained"),
    _row("backlash+road_grade", "backlash", group="pairs", outcome="incomplete", success=False),
]


def test_the_matrix_counts_the_strongest_name_or_none():
    matrix = confusion(ROWS)
    assert matrix == {
        "backlash": Counter({"backlash": 1, "stiffness_nonlinearity": 1}),
        "none": Counter({"(no mismatch)": 1}),
        "speed_stiffened_shaft": Counter({"(no name)": 1}),
    }
    assert columns(matrix) == ["backlash", "stiffness_nonlinearity", "(no mismatch)", "(no name)"]


def test_the_picture_has_a_cell_for_each_pair_and_its_counts():
    matrix = {"backlash": Counter({"backlash": 7, "(no name)": 1}), "none": Counter({"(no mismatch)": 8})}
    right = {"backlash": {"backlash"}, "none": {"(no mismatch)"}}
    tree = ET.fromstring(confusion_svg(matrix, right))
    tag = "{http://www.w3.org/2000/svg}"
    cells = [cell for cell in tree.iter(f"{tag}rect") if cell.get("stroke")]
    assert len(cells) == 2 * 3
    assert sorted(text.text for text in tree.iter(f"{tag}text") if text.text.isdigit()) == ["1", "7", "8"]
    colours = [_rgb(cell.get("fill")) for cell in cells]
    blue, red = [c[2] > c[0] for c in colours], [c[0] > c[2] for c in colours]
    assert blue == [True, False, False, False, True, False]  # backlash named; no mismatch where nothing was hidden
    assert red == [False, False, True, False, False, False]  # no name for a backlash


def test_a_look_alike_that_was_declared_is_right():
    rows = [
        _row("coulomb_friction_motor", "quadratic_friction", outcome="alike"),
        _row("backlash", "stiffness_nonlinearity", outcome="wrong", success=False),
    ]
    tree = ET.fromstring(confusion_of(rows))
    filled = [_rgb(cell.get("fill")) for cell in tree.iter("{http://www.w3.org/2000/svg}rect") if cell.get("stroke")]
    assert [c[2] > c[0] for c in filled if c[0] != c[2]] == [True, False]


def _rgb(colour):
    return tuple(int(colour[place : place + 2], 16) for place in (1, 3, 5))


def test_coverage_counts_intervals_and_not_what_has_none():
    sizes = [{"what": "gap", "inside": inside} for inside in (True, False, None)]
    assert coverage([_row("backlash", sizes=sizes)]) == {"gap": Rate(1, 2)}


def test_the_summary_says_how_often_each_group_got_what_it_should():
    data = summary(ROWS)
    assert data["groups"]["single"]["success"]["rate"] == 0.5
    assert data["groups"]["outside"]["success"]["rate"] == 1.0
    element = data["kinds"]["backlash"]["element"]
    assert (element["hits"], element["trials"]) == (2, 2)
    text = markdown(ROWS)
    assert "| `backlash` | 2 | 50 % |" in text
    assert "| an effect no entry describes | a mismatch, and no name | 1 | 100 % |" in text
    lines = [line for line in text.splitlines() if line.startswith("| `")]
    assert all(line.endswith(" |") for line in lines)


def test_an_empty_campaign_has_a_summary():
    assert "0 cases" in markdown([])
    assert json.loads(json.dumps(summary([])))["cases"] == 0


def test_an_answer_without_a_diagnosis_is_counted_as_failed():
    row = {**_row("backlash"), "outcome": "failed"}
    del row["verdict"]
    assert confusion([row]) == {"backlash": Counter({"(failed)": 1})}
    assert Answer(None).fault is None
