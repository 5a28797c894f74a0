"""docs/catalogue.md says what the catalogue says."""

from __future__ import annotations

from estimator.physics.catalogue import EFFECTS
from tests.docs.catalogue_page import PAGE, facts_of, facts_on_page, up_to_date

CURE = "run: python tests/docs/catalogue_page.py"


def test_every_effect_has_a_section_in_the_order_of_the_catalogue() -> None:
    assert list(facts_on_page()) == list(EFFECTS), "add or move a section '<!-- facts: NAME -->' by hand"
    text = PAGE.read_text(encoding="utf-8")
    for name in EFFECTS:
        assert f"\n### {name}\n" in text


def test_the_facts_are_those_of_the_catalogue() -> None:
    for name, facts in facts_on_page().items():
        assert facts == facts_of(EFFECTS[name]), CURE


def test_what_is_listed_as_planned_is_not_there_yet() -> None:
    planned = PAGE.read_text(encoding="utf-8").partition("## Not in the catalogue yet")[2]
    rows = [line.split("|")[2] for line in planned.splitlines() if line.startswith("| ")][2:]
    names = {name.strip() for row in rows for name in row.split(",")}
    assert len(names) > 1
    assert not names & set(EFFECTS)


def test_a_stale_page_is_noticed_and_mended() -> None:
    text = PAGE.read_text(encoding="utf-8")
    stale = text.replace("T_f = T_c sign(w_M)", "T_f = T_c")
    assert stale != text
    assert up_to_date(stale) == text
