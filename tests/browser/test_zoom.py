"""A long recording can be zoomed to its samples, and its page stays small."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hil.cli.main import run
from hil.report import page as html
from hil.report.figures import Curve, Panel, Style, input_lines, time_figure
from hil.report.page import Figure
from tests.browser.conftest import opened

SAMPLES, PERIOD_S = 40_000, 1e-3
TIME_S = PERIOD_S * np.arange(SAMPLES)
SPEED = 50.0 + 10.0 * np.sin(TIME_S) + np.random.default_rng(1).normal(scale=0.1, size=SAMPLES)
TORQUE = np.repeat(np.random.default_rng(2).choice([-80.0, 80.0], SAMPLES // 10), 10)
GAP = slice(20_010, 20_020)
STEP = np.ptp(SPEED) / 65_000
"""What a sample may be off: it is kept in 16 bits of its line's range."""


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    speed = SPEED.copy()
    speed[GAP] = np.nan
    panels = (
        Panel("torque [Nm]", input_lines(TORQUE[:, np.newaxis])),
        Panel("speed [rad/s]", (Curve("measured", speed, Style.MEASURED),)),
    )
    text = html.page("zoom", [html.section("Run", time_figure("run", TIME_S, panels, 1))], "")
    path = tmp_path_factory.mktemp("zoom") / "zoom.html"
    path.write_text(text)
    return path


def lines(shown: Any) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = shown.page.evaluate(
        "document.querySelector('.plotly-graph-div')._fullData.map((t) => ({x: Array.from(t.x), y: Array.from(t.y)}))"
    )
    return found


def test_it_is_zoomed_to_every_sample_and_back(browser: Any, page: Path) -> None:
    with opened(browser, page, 1200) as shown:
        shown.wait_until_drawn()
        whole = lines(shown)
        assert all(1000 < len(line["x"]) <= 3002 for line in whole)
        zoomed = "{'xaxis.range': range, 'xaxis2.range': range}"
        relayout = f"(range) => Plotly.relayout(document.querySelector('.plotly-graph-div'), {zoomed})"
        shown.page.evaluate(relayout, [20.0, 20.1])
        torque, speed = lines(shown)
        rows = slice(19_999, 20_102)
        np.testing.assert_allclose(speed["x"], TIME_S[rows], atol=1e-9)
        np.testing.assert_allclose(torque["y"], TORQUE[rows], atol=160.0 / 65_000)
        there = [i for i, value in enumerate(speed["y"]) if value is not None]
        assert sorted(set(range(103)) - set(there)) == list(range(11, 21))
        np.testing.assert_allclose([speed["y"][i] for i in there], SPEED[rows][there], atol=STEP)
        shown.page.evaluate(relayout, [0.0, 39.999])
        assert lines(shown) == whole
        assert shown.complaints == []


def test_thinning_is_said_and_torque_is_drawn_in_steps(page: Path) -> None:
    text = page.read_text()
    assert (
        "Drawn: the lowest and the highest of each 27 samples; zoomed in, every sample. 40000 samples in all." in text
    )
    figure = time_figure("run", TIME_S, [Panel("torque [Nm]", input_lines(TORQUE[:, np.newaxis]))], 1)[-1]
    assert isinstance(figure, Figure)
    assert '"shape":"hv"' in figure.content


def test_five_minutes_at_a_kilohertz_are_a_page_of_fifteen_megabytes() -> None:
    samples = 300_000
    time_s = 1e-3 * np.arange(samples)
    rng = np.random.default_rng(1)
    panels = tuple(
        Panel(axis, tuple(Curve(f"{axis} {i}", rng.normal(size=samples), Style.AFTER) for i in range(count)))
        for axis, count in (("torque", 2), ("speed", 4), ("error", 2))
    )
    text = html.page("long", [html.section("Run", time_figure("run", time_s, panels, 1))], "")
    assert "zoomed in, every sample" in text
    assert len(text.encode()) < 15e6


ROWS = ["t [s],T [Nm],<b>n</b> [1/min]", *(f"{0.01 * k:.2f},{50 * (-1) ** (k // 40)},{k % 300}" for k in range(2000))]
"""A recording whose channels have names that would be markup."""


def test_the_stretch_in_view_is_what_signals_cut(browser: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from playwright.sync_api import expect

    monkeypatch.chdir(tmp_path)
    (tmp_path / "run.csv").write_text("\n".join(ROWS[:800] + ROWS[900:]))
    assert run(["look", "run.csv", "--plot"]) == 0
    with opened(browser, tmp_path / "run.look.html", 1200) as shown:
        shown.wait_until_drawn()
        lines = shown.page.locator(".cut pre")
        assert lines.text_content() == "from_s = 0.00\nto_s = 19.99"
        shown.page.locator(".plotly-graph-div").focus()
        shown.page.keyboard.press("+")
        expect(lines).to_have_text("from_s = 4.997\nto_s = 14.992")
        shown.page.locator(".cut button").first.click()
        expect(lines).to_have_text("stretches = [[4.997, 14.992]]")
        shown.page.locator(".cut button").last.click()
        expect(lines).to_have_text("from_s = 0.00\nto_s = 19.99")
        assert "<b>n</b>" in shown.page.locator(".plotly-graph-div").text_content()
        shapes = shown.page.evaluate("document.querySelector('.plotly-graph-div').layout.shapes")
        marks = [[each["x0"], each["x1"]] for each in shapes]
        assert [7.98, 8.99] in marks  # the gap
