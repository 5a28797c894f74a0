"""Each report opens offline without a complaint, is readable at any width, by keys alone, and on paper."""

import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from hil.commission.engine import STEPS
from hil.provenance import Provenance, Source
from hil.report.commission_html import commission_page
from hil.report.comparison_html import comparison_page
from hil.report.diagnosis_html import diagnosis_page
from hil.report.identification_page import identification_page
from tests.browser.conftest import Opened, opened
from tests.browser.results import comparisons, identified
from tests.chosen import one_in
from tests.commission.whole_state import whole_state
from tests.report.conftest import diagnosis as hand_made_diagnosis

PHONE, DESK = 360, 1600
A4_HEIGHT_PX = 96 * 297 / 25.4


MADE = Provenance(
    "hil 0.3.0 (0123456789ab)",
    "2026-11-27T10:00:00+00:00",
    "",
    (Source("model.toml", "0"),),
    (Source("run_1.csv", "1"),),
)

PAGES: dict[str, Callable[[], str]] = {
    "identification": lambda: identification_page(*identified()),
    "diagnosis": lambda: diagnosis_page(hand_made_diagnosis.__wrapped__()),
    "comparison": lambda: comparison_page(comparisons(), MADE),
    "commissioning": lambda: commission_page(whole_state(Path()).document(), {step.name: step.title for step in STEPS}),
}


@pytest.fixture(scope="module", params=one_in(2, PAGES))
def report(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("pages") / f"{request.param}.html"
    path.write_text(PAGES[request.param](), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def on_a_phone(browser: Any, report: Path) -> Iterator[Opened]:
    """Open a report once for all tests: to draw its figures takes longer than what a test does with them."""
    with opened(browser, report, PHONE) as shown:
        yield shown


@pytest.fixture(scope="module")
def on_a_desk(browser: Any, report: Path) -> Iterator[Opened]:
    """Open it as wide as a desk's screen; each test leaves it as it was."""
    with opened(browser, report, DESK) as shown:
        yield shown


@pytest.mark.usefixtures("report")  # of which there are several; the screens are asked for by name
@pytest.mark.parametrize(("screen", "width"), [("on_a_phone", PHONE), ("on_a_desk", DESK)])
def test_it_opens_offline_without_a_complaint_and_fits_its_width(
    request: pytest.FixtureRequest, screen: str, width: int
) -> None:
    shown = request.getfixturevalue(screen)
    assert shown.complaints == []
    assert shown.page.evaluate("innerWidth") == width
    assert shown.page.evaluate("document.documentElement.scrollWidth") <= width
    too_wide = shown.page.evaluate(
        """() => [...document.querySelectorAll('.plotly-graph-div svg.main-svg, p, h1, h2, .tiles')]
                 .filter((each) => each.getBoundingClientRect().right > innerWidth + 1)
                 .map((each) => each.outerHTML.slice(0, 80))"""
    )
    assert too_wide == []
    tables = "[...document.querySelectorAll('.wide')].filter((each) => each.scrollWidth > each.clientWidth + 1).length"
    assert shown.page.evaluate(tables) == 0  # none has to be scrolled


def test_it_can_be_read_with_a_keyboard_alone(on_a_phone: Opened) -> None:
    page = on_a_phone.page
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.className") == "skip"
    assert page.evaluate("document.activeElement.getBoundingClientRect().left") >= 0  # it shows where it has the focus
    page.keyboard.press("Enter")
    assert page.evaluate("document.activeElement.id") == "main"
    seen = set()
    for _ in range(400):
        page.keyboard.press("Tab")
        name = page.evaluate("document.activeElement.className.baseVal ?? document.activeElement.className")
        kind = page.evaluate("document.activeElement.tagName")
        if kind == "BODY":
            break
        seen.add(str(name).split(" ")[0])
    else:
        pytest.fail("the focus never left the page: it is trapped")
    assert {"plotly-graph-div", "modebar-btn"} <= seen


def test_the_sections_are_reached_by_their_links(on_a_desk: Opened) -> None:
    page = on_a_desk.page
    links = page.locator("nav a")
    assert links.count() >= 3
    last = links.nth(links.count() - 1)
    target = last.get_attribute("href")
    last.focus()
    page.keyboard.press("Enter")
    assert page.evaluate(f"document.querySelector('{target}').getBoundingClientRect().top") < 1000
    addresses = page.eval_on_selector_all("[id]", "all => all.map((each) => each.id)")
    assert len(addresses) == len(set(addresses))


def test_a_figure_takes_keys(on_a_desk: Opened) -> None:
    page = on_a_desk.page
    first = page.locator(".plotly-graph-div").first
    first.focus()
    span = "() => { const d = document.activeElement; return d._fullLayout.xaxis.range.map(Number); }"
    low, high = page.evaluate(span)
    page.keyboard.press("+")
    on_a_desk.wait_for(f"({span})()[1] - ({span})()[0] < {0.9 * (high - low)}")
    page.keyboard.press("0")
    on_a_desk.wait_for(f"({span})()[1] - ({span})()[0] > {0.9 * (high - low)}")
    visible = "document.activeElement.data.filter((each) => each.visible !== 'legendonly').length"
    before = page.evaluate(visible)
    page.keyboard.press("1")
    on_a_desk.wait_for(f"{visible} !== {before}")
    page.keyboard.press("1")
    on_a_desk.wait_for(f"{visible} === {before}")
    assert on_a_desk.complaints == []


def test_on_paper_nothing_is_cut_off_and_the_screen_comes_back(on_a_desk: Opened) -> None:
    page = on_a_desk.page
    widths = "[...document.querySelectorAll('.plotly-graph-div')].map((each) => each._fullLayout.width)"
    before = page.evaluate(widths)
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    paper_width_px = 96 * (210 - 2 * 12) / 25.4  # A4 less the margins of the style sheet
    on_a_desk.wait_for(f"{widths}.every((each) => each <= {paper_width_px})")
    page.evaluate("dispatchEvent(new Event('afterprint'))")
    on_a_desk.wait_for(f"JSON.stringify({widths}) === '{before}'.replaceAll(' ', '')")
    printed = page.pdf(format="A4")
    pages = max(int(count) for count in re.findall(rb"/Count (\d+)", printed))
    height_px = page.evaluate("document.documentElement.scrollHeight")
    assert 1 <= pages <= 2 + height_px / (0.5 * A4_HEIGHT_PX)  # pages are half full at least
    assert on_a_desk.complaints == []


def test_text_stands_out_from_its_ground(on_a_desk: Opened) -> None:
    weak = on_a_desk.page.evaluate(
        """() => {
          const lum = (c) => c.map((v) => v / 255).map((v) => v <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4)
                              .reduce((sum, v, i) => sum + v * [0.2126, 0.7152, 0.0722][i], 0);
          const rgb = (text) => text.match(/[\\d.]+/g).map(Number);
          const ground = (node) => {
            for (let at = node; at; at = at.parentElement) {
              const c = rgb(getComputedStyle(at).backgroundColor);
              if (c.length === 3 || c[3] > 0) return c.slice(0, 3);
            }
            return [255, 255, 255];
          };
          return [...document.querySelectorAll('main p, main td, main th, main h1, main h2, .badge, nav a, .tile span')]
            .filter((node) => node.textContent.trim())
            .map((node) => {
              const [a, b] = [lum(rgb(getComputedStyle(node).color).slice(0, 3)), lum(ground(node))];
              return [(Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05), node.textContent.slice(0, 40)];
            })
            .filter(([ratio]) => ratio < 4.5);
        }"""
    )
    assert weak == []  # WCAG 2.1, success criterion 1.4.3
