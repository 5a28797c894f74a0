"""What could not be believed beside what was chosen is not fitted, and nothing else is left out."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.evidence import Gain
from estimator.diagnosis.hypotheses import NOTHING, Effects
from estimator.diagnosis.selection.outdone import least_price, outdone, places
from estimator.diagnosis.unnamed import UnnamedLaw
from estimator.physics.catalogue import EFFECTS
from estimator.physics.effect import Element
from estimator.physics.fit import FitResult
from tests.estimator.diagnosis.planted import nominal_fit, quiet
from tests.estimator.diagnosis.selection.mass import selector
from tests.estimator.physics.bench import ONE_MASS, TWO_MASS

NAMES = tuple(name for name, entry in EFFECTS.items() if not entry.recognised)
N = 9000.0
FALL = 0.7
"""RMS that a law leaves, over that of the re-tuned nominal."""


@pytest.fixture(scope="module")
def retuned() -> FitResult:
    return nominal_fit(quiet(values=TWO_MASS))


def law(retuned: FitResult, element: Element, price: float) -> UnnamedLaw:
    """A law that is bought with so many unknowns."""
    gained = 2.0 * N * math.log(1.0 / FALL) - price * math.log(N)
    return UnnamedLaw(element, (("w |w|", 1.0),), Gain(gained, 1e-300, N), FALL * retuned.rms)


def beside(retuned: FitResult, element: Element, chosen: Effects, price: float = 1.7, noise: float = 0.75) -> Effects:
    return outdone(law(retuned, element, price), retuned, noise * retuned.rms, chosen, NAMES)


def test_what_acts_where_a_cheap_law_does_may_say_the_same(retuned: FitResult) -> None:
    left_out = beside(retuned, Element.SPEED_SENSOR, frozenset({"inertia_change"}))
    assert {"road_grade", "torque_saturation", "coulomb_friction_motor"} <= left_out
    assert not left_out & {"resolver_error", "speed_filter", "speed_sign_blind"}
    assert "transport_delay" not in left_out  # no recording tells it from a filter of the speed
    assert "inertia_change" not in left_out


def test_beside_one_that_acts_there_any_may(retuned: FitResult) -> None:
    assert beside(retuned, Element.SPEED_SENSOR, frozenset({"resolver_error"})) == NOTHING


def test_three_are_not_believed_together_wherever_they_act(retuned: FitResult) -> None:
    two = frozenset({"resolver_error", "inertia_change"})
    assert beside(retuned, Element.SPEED_SENSOR, two) == frozenset(NAMES) - two


def test_a_law_as_dear_as_they_are_rules_nothing_out(retuned: FitResult) -> None:
    chosen = frozenset({"inertia_change"})
    margin = 10.0 / math.log(N)
    dear = least_price(2, len(NAMES), N) - margin
    assert beside(retuned, Element.SPEED_SENSOR, chosen, price=dear + 0.01) == NOTHING
    assert beside(retuned, Element.SPEED_SENSOR, chosen, price=dear - 0.01) != NOTHING


def test_a_law_that_leaves_more_than_the_noise_rules_nothing_out(retuned: FitResult) -> None:
    assert beside(retuned, Element.SPEED_SENSOR, frozenset({"inertia_change"}), noise=0.69) == NOTHING


def test_without_a_law_nothing_is_ruled_out(retuned: FitResult) -> None:
    assert outdone(None, retuned, 1.0, frozenset({"inertia_change"}), NAMES) == NOTHING


def test_an_effect_is_wherever_its_look_alikes_are() -> None:
    assert places("tyre_slip") == {EFFECTS["tyre_slip"].element, EFFECTS["extra_torsional_mode"].element}
    assert {Element.TORQUE_PATH, Element.SPEED_SENSOR} <= places("transport_delay")


def test_a_search_fits_no_three_where_one_law_says_it_all() -> None:
    """A reading that is off by its square: no entry of the catalogue, and each of several takes a part of it."""
    sound = quiet((1, 2), ONE_MASS, 1200)
    records = [replace(rec, output=rec.output + 0.01 * rec.output * np.abs(rec.output)) for rec in sound]
    select = selector(records)
    found = select.run()
    fitted = {len(effects) for effects in select.jury.bench._rough}
    assert found.unnamed is not None
    assert found.unnamed.terms[0][0] == "w |w|"
    assert fitted == {1, 2}
    assert found.result.rms > 1.2 * found.unnamed.rms
