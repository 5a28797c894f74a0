"""Whatever text stands in a result, nothing of it runs in a page: each page, opened in a real browser."""

import dataclasses
from collections.abc import Callable, Mapping
from enum import Enum
from pathlib import Path
from typing import Any

import pytest

from hil.commission.engine import STEPS
from hil.proof.scoreboard import Board, scoreboard_page
from hil.provenance import Provenance, Source
from hil.report import page as html
from hil.report.commission_html import commission_page
from hil.report.comparison_html import comparison_page
from hil.report.diagnosis_html import diagnosis_page
from hil.report.identification_page import identification_page
from hil.report.paper_page import paper_page
from tests.browser.conftest import opened
from tests.browser.results import comparisons, identified, paper_results
from tests.commission.whole_state import whole_state
from tests.report.conftest import diagnosis as hand_made_diagnosis

RUN = "document.documentElement.dataset.ran='yes'"
HOSTILE = " ".join(
    (
        f"<script>{RUN}</script>",
        f"\"'><img src=x onerror=\"{RUN}\"><svg onload='{RUN}'>",
        f"</script></style></title><script>{RUN}</script>",
        f'<a href="javascript:{RUN}">x</a>',
        "{{ 7 * 7 }}",
    )
)
KEPT = ("place", "kind", "at", "status", "utc")
"""Fields that hold one of a few words, or a moment: the program looks them up."""

MADE = Provenance(HOSTILE, "2026-11-27T10:00:00+00:00", HOSTILE, (Source(HOSTILE, "0"),), (Source(HOSTILE, "1"),))


def hostile(value: Any, field: str = "") -> Any:
    """Return a result with markup after every text of it, keys included, so that names still agree."""
    if isinstance(value, str) and not isinstance(value, Enum):
        return value + HOSTILE if value and not field.endswith(KEPT) else value
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        made = object.__new__(type(value))  # past what a constructor refuses
        for each in dataclasses.fields(value):
            object.__setattr__(made, each.name, hostile(getattr(value, each.name), each.name))
        return made
    if isinstance(value, Mapping):
        return {hostile(key): hostile(each, field) for key, each in value.items()}
    return type(value)(hostile(each, field) for each in value) if isinstance(value, list | tuple) else value


def hostile_state(folder: Path) -> str:
    document = _values(whole_state(folder).document())
    document["steps"]["diagnosis"]["evidence"]["report"] = f"javascript:{RUN}"
    return commission_page(document, {step.name: step.title for step in STEPS}, MADE)


def _values(value: Any, key: str = "") -> Any:
    """Put markup after every text of a document, but what is looked up: its keys stay."""
    if isinstance(value, str):
        return value if key.endswith(KEPT) else value + HOSTILE
    if isinstance(value, dict):
        return {name: _values(each, name) for name, each in value.items()}
    return [_values(each, key) for each in value] if isinstance(value, list) else value


def hostile_paper(folder: Path) -> str:
    for name in ("fig2", "fig4", "fig5"):
        (folder / f"{name}.svg").write_text(f'<svg xmlns="http://www.w3.org/2000/svg"><script>{RUN}</script></svg>')
    return paper_page(*hostile(paper_results()), folder, MADE)


def hostile_scoreboard(_: Path) -> str:
    rig = {"case": "clutch", "where": "the PLC", "said": "open", "outcome": "right", "success": True}
    size = {"what": "gap", "unit": "mm", "truth": 4.0, "found": 4.1, "ci95": [4.0, 4.2], "inside": True, "within": True}
    run = {
        "name": "sines",
        "verdict": "explained",
        "named": ["backlash"],
        "fault": None,
        "held_out": {"before": 1.11, "after": 0.2},
        "right": True,
        "agreements": [{**size, "asked": "within 10 %"}],
        "report": f"javascript:{RUN}",
    }
    case = {"title": "A joint", "concealed": ["backlash"], "conceals": "its gap", "runs": [run]}
    return scoreboard_page(Board([], [_values(rig)], [_values(case)], MADE))


PAGES: dict[str, Callable[[Path], str]] = {
    "diagnosis": lambda _: diagnosis_page(hostile(hand_made_diagnosis.__wrapped__()), MADE),
    "comparison": lambda _: comparison_page(hostile(comparisons()), MADE),
    "identification": lambda _: identification_page(*hostile(identified()), MADE),
    "paper": hostile_paper,
    "commissioning": hostile_state,
    "scoreboard": hostile_scoreboard,
}

PLANTED = 'document.querySelectorAll(\'img[src="x"], [onload], [onerror], a[href^="javascript" i]\').length'
RAN = "document.documentElement.dataset.ran || ''"


@pytest.mark.parametrize("name", PAGES)
def test_no_text_of_a_result_runs_or_becomes_markup(browser: Any, tmp_path: Path, name: str) -> None:
    path = tmp_path / "page.html"
    path.write_text(PAGES[name](tmp_path), encoding="utf-8")
    assert "onerror=" in path.read_text(encoding="utf-8")  # the text is there, as text
    with opened(browser, path, 1200) as shown:
        for link in shown.page.locator("main a:not([href='solve/report.html'])").all()[:20]:  # the page's own
            link.dispatch_event("click")
        assert shown.page.evaluate(RAN) == ""
        assert shown.page.evaluate(PLANTED) == 0
        assert shown.complaints == []


@pytest.mark.parametrize("has_policy", [True, False])
def test_what_gets_past_the_template_does_not_run(browser: Any, tmp_path: Path, has_policy: bool) -> None:
    """Without the policy it does: the test can fail."""
    planted = f"<script>{RUN}</script><img src='data:,' onerror=\"{RUN}\"><main"
    text = html.page("title", [html.section("Section", html.paragraph("text"))], "").replace("<main", planted)
    path = tmp_path / "page.html"
    path.write_text(text if has_policy else text.replace("Content-Security-Policy", "x-none"), encoding="utf-8")
    with opened(browser, path, 800) as shown:
        shown.page.wait_for_timeout(200)
        assert shown.page.evaluate(RAN) == ("" if has_policy else "yes")


@pytest.mark.parametrize(
    ("href", "allowed"),
    [
        ("diagnosis/report.html", True),
        ("a:b/report.html", False),
        ("./a:b/report.html", True),
        ("#section", True),
        ("https://example.org/x", True),
        ("javascript:alert(1)", False),
        ("JaVaScRiPt:alert(1)", False),
        (" javascript:alert(1)", False),
        ("java\tscript:alert(1)", False),
        ("\x01javascript:alert(1)", False),
        ("data:text/html,x", False),
        ("vbscript:x", False),
        ("file:///etc/passwd", False),
        ("//example.org/x", False),
        ("\\\\example.org\\x", False),
        ("https:x", False),
    ],
)
def test_links_keep_to_allowed_schemes(href: str, allowed: bool) -> None:
    assert html.is_allowed(href) is allowed
    assert ("<a " in html.fragment(html.paragraph(html.Link("text", href)))) is allowed
