"""Several opened sets added up."""

import json

import pytest

from hil.proof.campaign import sets


def row(planted, group, outcome, *named):
    return {
        "case": "case_001",
        "kind": planted,
        "group": group,
        "seed": 1,
        "outcome": outcome,
        "success": outcome in ("right", "alike"),
        "fault": None,
        "diagnose_s": 10.0,
        "simulate_s": 1.0,
        "fresh_over_floor": [1.0],
        "verdict": "explained" if named else "unexplained",
        "named": list(named),
        "element": "load",
        "element_right": True,
        "event_iou": {},
        "sizes": [],
        "fit": {},
        "band": None,
    }


def opened(folder, *rows):
    folder.mkdir()
    (folder / "scoreboard.json").write_text(
        json.dumps({"schema": "hil.prove/1", "cases": list(rows)}), encoding="utf-8"
    )
    return folder


def test_the_cases_of_all_sets_are_counted_together(tmp_path, capsys):
    first = opened(tmp_path / "one", row("backlash", "single", "right", "backlash"))
    second = opened(
        tmp_path / "two",
        row("backlash", "single", "abstained"),
        row("tyre_slip+road_grade", "pairs", "right", "tyre_slip", "road_grade"),
    )
    assert sets.main([str(first), str(second), "--out", str(tmp_path / "out")]) == 0
    assert capsys.readouterr().out.strip() == str(tmp_path / "out" / "summary.md")
    reported = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
    assert reported["cases"] == 3
    assert "| `backlash` | 2 | 50 % |" in (tmp_path / "out" / "summary.md").read_text(encoding="utf-8")
    assert (tmp_path / "out" / "confusion.svg").read_text(encoding="utf-8").startswith("<svg")


@pytest.mark.parametrize("content", [None, "{}", "no scoreboard"])
def test_what_is_no_opened_set_is_refused_and_nothing_is_written(tmp_path, capsys, content):
    folder = tmp_path / "closed"
    folder.mkdir()
    if content is not None:
        (folder / "scoreboard.json").write_text(content, encoding="utf-8")
    with pytest.raises(SystemExit):
        sets.main([str(folder), "--out", str(tmp_path / "out")])
    said = " ".join(capsys.readouterr().err.split())
    assert "scoreboard" in said
    assert not (tmp_path / "out").exists()
