"""Figures of the manual come from result files, and say themselves where they are older than what they measure."""

import pytest

from tests.docs.pages import ROOT, pages
from tests.docs.results import Result, git, has_history, places, results, with_results

RENEW = "run: python -m tests.docs.results"

pytestmark = pytest.mark.skipif(not has_history(), reason="needs the commits of the project: a whole clone")


def test_every_place_shows_its_result_and_whether_it_is_of_an_older_version() -> None:
    stale = []
    for page in pages():
        for name, filled in places(page.read_text("utf-8")).items():
            result = results()[name]
            marked = (
                "**older than" in filled
            )  # a mark that is no longer needed does no harm until it is filled in again
            if result.shown not in filled or f"commit {result.commit}" not in filled or result.outdated > marked:
                stale.append(f"{page.relative_to(ROOT)}: {name}")
    assert stale == [], RENEW


def test_every_result_is_shown_and_its_commit_is_one_of_the_project() -> None:
    shown = {name for page in pages() for name in places(page.read_text("utf-8"))}
    assert shown == set(results())
    for result in results().values():
        assert git("cat-file", "-t", result.commit) == "commit"
        assert [room for room in result.rooms if not (ROOT / room).exists()] == []


def test_a_figure_without_its_program_or_before_a_change_is_outdated() -> None:
    first = git("rev-list", "--max-parents=0", "HEAD").splitlines()[0]
    head = git("rev-parse", "HEAD")
    assert Result("a", "make bench", first, ("hil",), "x").outdated
    assert not Result("a", "make bench", head, ("hil",), "x").outdated
    assert Result("a", "", head, ("hil",), "x").outdated
    assert "older than `hil`" in Result("a", "", head, ("hil",), "x").filled


def test_of_a_long_table_the_totals_and_what_was_wrong_are_shown() -> None:
    text = (
        "| fault | runs | worst [s] | wrong |\n| --- | --- | --- | --- |\n| a | 3 | 0.20 | 0 |\n| b | 4 | 0.10 | 2 |\n"
    )
    lines = Result("a", "make bench", "x", ("hil",), text, ("sum", "max", "sum")).shown.splitlines()
    assert lines[2:] == ["| all 2 | 7 | 0.20 | 2 |", "| b | 4 | 0.10 | 2 |"]


def test_a_place_is_filled_in_and_filled_in_again_alike() -> None:
    name = next(iter(results()))
    page = f"Before.\n\n<!-- result: {name} -->\n<!-- end -->\n\nAfter.\n"
    filled = with_results(page)
    assert results()[name].shown in filled
    assert with_results(filled) == filled
