"""docs/catalogue.md says what the catalogue says, and shows what each effect does."""

import xml.etree.ElementTree as ET
from pathlib import Path
from typing import get_args

import numpy as np
import pytest

from estimator.physics.catalogue import EFFECTS
from hil.config.experiment_tables import AnyExperiment
from tests.docs import signature_pictures
from tests.docs.catalogue_page import PAGE, facts_of, facts_on_page, up_to_date
from tests.docs.signatures import SHOWN, signature
from tests.estimator.physics.test_catalogue import EXPERIMENTS

CURE = "run: python tests/docs/catalogue_page.py"
DRAW = "run: python -m tests.docs.signature_pictures"
MOST_BYTES = 1_900_000


def test_every_effect_has_a_section_in_the_order_of_the_catalogue() -> None:
    assert list(facts_on_page()) == list(EFFECTS), "add or move a section '<!-- facts: NAME -->' by hand"
    text = PAGE.read_text(encoding="utf-8")
    for name in EFFECTS:
        assert f"\n### {name}\n" in text


def test_the_facts_are_those_of_the_catalogue() -> None:
    for name, facts in facts_on_page().items():
        assert facts == facts_of(EFFECTS[name]), CURE


def test_a_stale_page_is_noticed_and_mended() -> None:
    text = PAGE.read_text(encoding="utf-8")
    stale = text.replace("T_f = T_c sign(w_M)", "T_f = T_c")
    assert stale != text
    assert up_to_date(stale) == text


def test_tests_that_entries_suggest_are_experiments_of_the_rig() -> None:
    union, _ = get_args(AnyExperiment)
    kinds = {get_args(table.model_fields["kind"].annotation)[0] for table in get_args(union)}
    assert kinds >= EXPERIMENTS


def test_every_effect_has_its_picture_and_none_is_left_over() -> None:
    pictures = {path.stem: path for path in signature_pictures.FOLDER.glob("*")}
    assert set(pictures) == set(EFFECTS) == set(SHOWN), DRAW
    for path in pictures.values():
        assert ET.parse(path).getroot().tag.endswith("svg")
    assert sum(path.stat().st_size for path in pictures.values()) < MOST_BYTES


@pytest.mark.parametrize("name", EFFECTS)
def test_what_is_drawn_shows_the_effect(name: str) -> None:
    shown = signature(name)
    left = shown.recorded - shown.without
    if name == "lost_samples":  # what is there is right
        assert 0.05 < np.isnan(left).mean() < 0.5
        assert np.nanmax(np.abs(left)) < 1e-6
    else:
        assert np.sqrt(np.mean(left**2)) > 0.003 * np.ptp(shown.recorded)
    (_, x, plain), (_, u, law), *_ = shown.curve.lines
    assert x.size > 10
    assert u.size > 10
    assert plain.shape != law.shape or not np.array_equal(plain, law)


def test_a_picture_is_drawn_alike_twice(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(signature_pictures, "FOLDER", tmp_path)
    first, second = (signature_pictures.picture("backlash").read_bytes() for _ in range(2))
    assert first == second
