"""docs/gallery.md shows what the tool says of each failure. The slow ones: ``python -m tests.docs.gallery --check``."""

import xml.etree.ElementTree as ET

import pytest

from tests.docs.gallery.case import skeleton, tell
from tests.docs.gallery.draw import FOLDER
from tests.docs.gallery.page import FAILURES, PAGE, pictures, shown_of, shown_on_page, with_shown

RENEW = "run: python -m tests.docs.gallery"
QUICK = [name for name, failure in FAILURES.items() if failure.quick]
MOST_BYTES = 1_500_000


def test_every_failure_has_its_place_cause_and_cure() -> None:
    shown = shown_on_page()
    assert set(shown) == set(FAILURES), "add or take out a place '<!-- shown: NAME -->' by hand"
    text = PAGE.read_text(encoding="utf-8")
    assert text.count("**Cause.**") == text.count("**Cure.**") == text.count("\n### ") == len(FAILURES)
    assert [name for name, part in shown.items() if "$ hil " not in part] == [], RENEW


def test_every_picture_is_shown_and_none_is_left_over() -> None:
    shown = {name for name, part in shown_on_page().items() if f"(images/gallery/{name}.svg)" in part}
    assert pictures() == shown, RENEW
    for path in FOLDER.glob("*"):
        assert ET.parse(path).getroot().tag.endswith("svg")
    assert sum(path.stat().st_size for path in FOLDER.glob("*")) < MOST_BYTES


@pytest.mark.parametrize("name", QUICK)
def test_the_tool_still_says_so(name: str) -> None:
    assert skeleton(shown_on_page()[name]) == skeleton(shown_of(name, tell(FAILURES[name]))), RENEW


def test_a_stale_place_is_noticed_and_mended() -> None:
    text = PAGE.read_text(encoding="utf-8")
    own = shown_on_page()["wrong_units"]
    stale = text.replace(own, own.replace("is the speed in rpm", "is all well"))
    assert stale != text
    assert skeleton(own) != skeleton(own.replace("is the speed in rpm", "is all well"))
    assert with_shown(stale, "wrong_units", own) == text
