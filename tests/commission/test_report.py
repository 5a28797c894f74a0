"""The report and the terminal's words, from a state file alone."""

import html
import io
import re
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

from hil.commission.engine import STEPS
from hil.commission.state import CommissioningState, Status, StepFinding, StepRecord, stated
from hil.commission.talk import findings_table, result_document, result_lines
from hil.orders.runner import RunRecord
from hil.report.commission_html import commission_page

TITLES = {step.name: step.title for step in STEPS}
OUTSIDE = StepFinding("gain <m2>", "equal within ±2 %", "3.1 ± 0.4 %", False, "Calibrate one")
OPEN = StepFinding("size", "0.5 to 2", "0.6 ± 0.2", None, "Repeat")
FLAT = [0.0, 0.0]


@pytest.fixture
def state(tmp_path: Path) -> dict[str, Any]:
    """Two steps done, one skipped, one interrupted twice, the rest to do."""
    made = CommissioningState(
        tmp_path, "bus & trailer", "rig.toml", 'name = "<bus>"', {name: StepRecord() for name in TITLES}
    )
    made.steps["devices"].end(Status.SKIPPED, "checked <yesterday>")
    signs = made.steps["signs"]
    signs.begin("d", keep_runs=False)
    signs.end(Status.INTERRUPTED, "interrupted by Ctrl-C or a signal")
    signs.begin("d", keep_runs=True)
    signs.findings = [OUTSIDE, OPEN, stated("torque", "20 Nm")]
    signs.runs = [
        RunRecord("m1", "runs/signs-m1.parquet", False, 3.5, {"speed_rad_s": [-0.2, 0.2]}, {"speed_rad_s": [-0.3, 0.3]})
    ]
    signs.end(Status.DONE)
    noise = made.steps["noise"]
    noise.begin("d", keep_runs=False)
    noise.evidence = {"course": {"time_s": [0.0, 1.0], "speed_rad_s": FLAT}}
    noise.findings = [StepFinding("noise", "little", "less", True)]
    noise.end(Status.DONE)
    return made.document()


def test_page_says_everything_and_fetches_nothing(state: dict[str, Any]) -> None:
    page = commission_page(state, TITLES)
    for text in (
        "not complete: 9 to do, next is limits",
        "gain &lt;m2&gt;",
        "3.1 ± 0.4 %",
        "→ Calibrate one",
        "✗ outside",
        "✓ within",
        "? can't tell",
        "because: checked &lt;yesterday&gt;",
        "m1 (ended early)",
        "Earlier attempts (1)",
        "name = &quot;&lt;bus&gt;&quot;",
        "noise-course",
    ):
        assert html.escape(html.unescape(text)) in page.replace("&#39;", "&#x27;").replace("&#34;", "&quot;"), text
    assert not re.search(r"<(script|link|img|iframe)\b[^>]*\b(src|href)=", page)


def test_result_tells_where_it_continues(state: dict[str, Any], tmp_path: Path) -> None:
    result = result_document(state, str(tmp_path), "commissioning.html")
    assert (result["complete"], result["outside"], result["driven_s"], result["model"]) == (False, 1, 3.5, None)
    assert "not complete: it continues with limits at the next call, 9 steps to go" in list(result_lines(result))
    assert "skipped: devices" in list(result_lines(result))
    assert f"report: {tmp_path / 'commissioning.html'}" in list(result_lines(result))


def test_findings_on_a_terminal_are_reported_in_words() -> None:
    console = Console(width=100, record=True, file=io.StringIO())
    console.print(findings_table("Signs", [OUTSIDE, OPEN, stated("torque", "20 Nm")]))
    text = console.export_text()
    assert "OUTSIDE" in text
    assert "can't tell" in text
    assert "→ Calibrate one" in text
    assert "gain <m2>" in text
