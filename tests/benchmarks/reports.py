"""Reports of long recordings: how large, how soon open in a browser. ``python -m tests.benchmarks.reports``.

A recording of 30 minutes at 10 ms is identified, and one of the same length stands in a diagnosis; each page is opened
in the system's chromium, offline. "opens" is the load event of the browser, "first figure" when the first of its
figures stands there. Wanted: at most 10 MB and 3 s.
"""

import argparse
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from estimator.identification.identify import identify, study
from estimator.identification.settings import Settings
from hil.figures.local_model import LocalModel
from hil.report.diagnosis_html import diagnosis_page
from hil.report.identification_page import identification_page
from tests.browser.conftest import CHROMIUM
from tests.estimator.identification.driveline import cruise
from tests.report.conftest import diagnosis as hand_made
from tests.report.conftest import trace

MINUTES = 30.0
PERIOD_S = 0.01
WANTED_MB, WANTED_S = 10.0, 3.0
FIRST_FIGURE = "document.querySelector('.plotly-graph-div svg.main-svg') !== null"


@dataclass(frozen=True)
class Opening:
    """One page: its name, what it takes up [MB], and how long it takes in the browser [s]."""

    name: str
    size_mb: float
    made_s: float
    opens_s: float
    first_figure_s: float


def identification(minutes: float) -> str:
    settings, record = Settings(), cruise(1, duration_s=60.0 * minutes, name="half_an_hour").record
    found = identify(record, settings)
    return identification_page([LocalModel(record, found)], [study(record, found, settings)])


def diagnosis(minutes: float) -> str:
    long = trace("half_an_hour", False, 1, round(60.0 * minutes / PERIOD_S))
    return diagnosis_page(replace(hand_made.__wrapped__(), traces=(long,)))


PAGES: dict[str, Callable[[float], str]] = {"identification": identification, "diagnosis": diagnosis}


def measure(browser: Any, name: str, minutes: float, folder: Path) -> Opening:
    """Make a page and open it in a context of its own."""
    path = folder / f"{name}.html"
    began = time.perf_counter()
    path.write_text(PAGES[name](minutes), encoding="utf-8")
    made_s = time.perf_counter() - began
    context = browser.new_context(viewport={"width": 1600, "height": 1000}, offline=True)
    page = context.new_page()
    began = time.perf_counter()
    page.goto(path.as_uri(), wait_until="load")
    opens_s = time.perf_counter() - began
    page.evaluate("document.querySelector('.plotly-graph-div').scrollIntoView()")
    page.wait_for_function(FIRST_FIGURE, timeout=60_000)
    first_s = time.perf_counter() - began
    context.close()
    return Opening(name, path.stat().st_size / 1e6, made_s, opens_s, first_s)


def lines(openings: list[Opening]) -> list[str]:
    """Return the table."""
    head = f"{'page':<16}{'made [s]':>10}{'size [MB]':>11}{'opens [s]':>11}{'first figure [s]':>18}  wanted"
    rows = [
        f"{each.name:<16}{each.made_s:>10.1f}{each.size_mb:>11.2f}{each.opens_s:>11.2f}{each.first_figure_s:>18.2f}  "
        f"{'yes' if each.size_mb <= WANTED_MB and each.opens_s <= WANTED_S else 'NO'}"
        for each in openings
    ]
    return [head, *rows]


def main() -> int:
    """Measure every page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=MINUTES)
    options = parser.parse_args()
    if not CHROMIUM:
        sys.stderr.write("no chromium on this machine: pages can't be opened\n")
        return 1
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright, tempfile.TemporaryDirectory() as folder:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        openings = [measure(browser, name, options.minutes, Path(folder)) for name in PAGES]
        browser.close()
    sys.stdout.write("\n".join(lines(openings)) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
