"""The page of a fleet: what it says, in a real browser with 10,000 recordings; and what its manual shows runs."""

import re
from pathlib import Path
from typing import Any

import pytest

from hil.fleet.dataset import Writer
from hil.fleet.page import _current as current, courses_of, fleet_page, usual_parameters
from hil.provenance import Provenance
from tests.browser.conftest import browser, opened
from tests.fleet import made_up
from tests.fleet.made_up import CHANGED, OUTLIER, write_fleet

__all__ = ["browser"]

MADE = Provenance("hil 0.3.0 (0123456789ab)", "2026-11-27T10:00:00+00:00", "", (), ())
VEHICLES, DRIVES = 200, 50
MANUAL = Path(__file__).parents[2] / "docs" / "fleet.md"


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Write 10,000 recordings; their verdicts, which the page only leads to, are left out."""
    folder = tmp_path_factory.mktemp("fleet") / "results"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("hil.fleet.dataset.write_whole", lambda *_: None)
        write_fleet(folder, VEHICLES, DRIVES)
    (folder / "fleet.html").write_text(fleet_page(folder, MADE), encoding="utf-8")
    return folder


def test_the_one_unlike_the_others_and_the_one_that_changed_are_found(results: Path) -> None:
    courses = courses_of(results, current(results))
    resonance = {vehicle: of[0] for (vehicle, _), of in courses.items()}
    away = {vehicle for vehicle, course in resonance.items() if course.pooled and course.pooled.is_outlier}
    assert f"bus_{OUTLIER}" in away
    assert len(away) <= 4
    step = resonance[f"bus_{CHANGED}"].change
    assert step is not None
    assert abs(step.first - DRIVES // 2) <= 1
    assert sum(course.change is not None for course in resonance.values()) <= 3
    known = resonance["bus_0"].usual
    assert known.mean == pytest.approx(made_up.RESONANCE_HZ, abs=0.02)
    assert known.between == pytest.approx(made_up.BETWEEN_HZ, rel=0.2)
    assert usual_parameters(results)["frequency_hz"].n_vehicles == VEHICLES


def test_the_last_result_of_a_recording_counts(tmp_path: Path) -> None:
    write_fleet(tmp_path, vehicles=2, drives=2)
    writer = Writer(tmp_path, "diagnose")
    rows = made_up._rows(1, 1, 9.9, False, 0.0)
    rows["recordings"][0] |= {"key": "of another version", "version": "1"}
    writer.add(rows, "{}\n")
    writer.finish()
    known = current(tmp_path)
    assert len(known) == 4
    assert known["of another version"]["frequency_hz"] == 9.9


def test_ten_thousand_recordings_open_in_a_second_and_filter_without_a_server(browser: Any, results: Path) -> None:
    with opened(browser, results / "fleet.html", 1400) as shown:
        page = shown.page
        shown.wait_for("document.querySelectorAll('#recordings tbody tr').length > 0")
        paint_ms = page.evaluate("performance.getEntriesByName('first-contentful-paint')[0].startTime")
        assert paint_ms < 1000.0
        assert page.locator("#recordings output").inner_text() == f"{VEHICLES * DRIVES} of {VEHICLES * DRIVES}"
        assert page.locator("#recordings tbody tr").count() < 100
        page.locator("#recordings input").fill("bus_9 backlash")
        shown.wait_for("document.querySelector('#recordings output').textContent !== '10000 of 10000'")
        matching = sum(f"bus_{v}".startswith("bus_9") for v in range(0, VEHICLES, 9)) * (DRIVES - 3)
        assert page.locator("#recordings output").inner_text() == f"{matching} of {VEHICLES * DRIVES}"
        href = page.locator("#recordings tbody a").first.get_attribute("href")
        assert re.fullmatch(r"verdicts/\d{12}\.json", href)
        page.locator("#vehicles input").fill(f"bus_{CHANGED} ")
        page.locator("#vehicles tbody button").first.click()
        shown.wait_for("document.querySelectorAll('.courses svg').length > 0")
        assert page.locator(".courses line.level").count() == 4  # before and after, of resonance and damping
        page.locator("#vehicles thead button").nth(1).click()
        assert shown.complaints == []


def test_what_the_manual_shows_of_the_results_runs(
    results: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    programs = re.findall(r"```python\n(.*?)```", MANUAL.read_text(encoding="utf-8"), re.DOTALL)
    assert len(programs) == 3
    monkeypatch.chdir(results.parent)
    said = []
    for program in programs:
        exec(program, {})
        said.append(capfd.readouterr().out)
    assert "bus_0" in said[0]
    assert "no_mismatch" in said[1]
    assert "drive_" in said[2]
