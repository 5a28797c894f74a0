"""Reports in a real browser: the system's chromium, headless, driven by playwright."""

import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

CHROMIUM = next(
    (path for name in ("chromium", "chromium-browser", "google-chrome") if (path := shutil.which(name))), ""
)

DRAWN = "[...document.querySelectorAll('.plotly-graph-div')].every((each) => each.querySelector('svg.main-svg'))"
"""True once every figure is there."""


LONGEST_S = 60.0


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """Start the browser; a machine without one can't judge pages.

    Not for the whole session: while it is there playwright keeps an event loop running in this thread, and no other
    test could have one.
    """
    if not CHROMIUM:
        pytest.skip("no chromium on this machine: pages can't be opened. Install one (Debian: apt install chromium).")
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield browser
        browser.close()


class Opened:
    """A page that was opened, and everything it complained of or fetched."""

    def __init__(self, page: Any) -> None:
        self.page = page
        self.complaints: list[str] = []
        page.on("pageerror", lambda error: self.complaints.append(f"script: {error}"))
        page.on("console", self._hear)
        page.on("request", self._watch)

    def _hear(self, message: Any) -> None:
        if message.type in ("error", "warning"):
            self.complaints.append(f"console: {message.text}")

    def _watch(self, request: Any) -> None:
        if not request.url.startswith(("file:", "data:", "blob:")):
            self.complaints.append(f"fetched: {request.url}")

    def wait_until_drawn(self) -> None:
        self.wait_for(DRAWN)

    def wait_for(self, expression: str) -> None:
        """Wait until an expression is true; the page's policy allows none that is kept there, so it is asked anew."""
        end = time.monotonic() + LONGEST_S
        while not self.page.evaluate(expression):
            if time.monotonic() > end:
                pytest.fail(f"not true after {LONGEST_S:g} s: {expression}; complaints: {self.complaints}")
            self.page.wait_for_timeout(20)


@contextmanager
def opened(browser: Any, path: Path, width: int, height: int = 1000) -> Iterator[Opened]:
    """Open a file at a width, without any network, and wait until its figures are drawn."""
    with browser.new_context(viewport={"width": width, "height": height}, offline=True) as context:
        opened = Opened(context.new_page())
        opened.page.goto(path.resolve().as_uri())
        opened.wait_until_drawn()
        yield opened
