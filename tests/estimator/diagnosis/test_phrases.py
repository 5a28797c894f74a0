"""Phrases: a formula has its coefficient, what is said in words has none; every element has its place."""

from __future__ import annotations

import re

import pytest

from estimator.diagnosis.inference.wording import Context, law_in_words, statement
from estimator.diagnosis.result import Effort, Fit, Slight, Verdict
from estimator.diagnosis.unnamed.laws import LAWS
from estimator.physics.effect import Element

A_PHRASE, A_FORMULA = ("a function of T", 27.5), ("T^3", -3.22e-7)


@pytest.mark.parametrize(
    ("element", "terms", "said"),
    [
        (Element.SPEED_SENSOR, [("w", -0.316)], "looks as if the speed read 31.6 % low"),
        (Element.SPEED_SENSOR, [("dw/dt", -0.012)], "looks as if the speed were read 12 ms late"),
        (Element.TORQUE_PATH, [("T", 0.05)], "looks as if the torque were 5 % above its reading"),
        (Element.TORQUE_PATH, [("T_2", 0.05)], "depends on the torque of input 2, in the torque path"),
        (
            Element.SHAFT,
            [("d twist/dt |w_M|", 3e-7)],
            "depends on how fast the twist changes and the motor speed, in the shaft",
        ),
        (Element.MOTOR, [A_FORMULA, A_PHRASE], "depends on the torque, at the motor"),
        (
            Element.LOAD,
            [("a load step at 3.1 s in run_1", 4.0)],
            "looks like a load step at 3.1 s in run_1, at the load",
        ),
        (
            Element.SPEED_SENSOR,
            [("|w|", 2.0), ("a wave 2 times per motor turn", 1.5), ("dw/dt", 1.0), ("T", 9.0)],  # the first three
            "depends on the speed and the acceleration and looks like a wave 2 times per motor turn, in the reading",
        ),
    ],
)
def test_a_law_is_said_by_what_it_goes_with(element: Element, terms: list[tuple[str, float]], said: str) -> None:
    assert law_in_words(element, terms) == said


@pytest.mark.parametrize(("element", "name"), [(element, name) for element, laws in LAWS.items() for name in laws])
def test_no_formula_is_said(element: Element, name: str) -> None:
    said = law_in_words(element, [(name, 0.5)])
    assert not re.search(r"w_|\^|\||\b[Tt]\b", said), said


def test_a_trace_says_what_it_does_to_the_values() -> None:
    fit = Fit("rad/s", 0.2, 0.05, 0.05, 0.05, 0.05, 0.05)
    still, moving = Slight("resolver_error", 0.001, {}), Slight("inertia_change", 0.002, {}, {"J_M": -0.05})
    said = statement(Verdict.NO_MISMATCH, fit, (), Effort(), Context(traces=(still, moving)))
    assert "Seen, but too small to matter: resolver_error, inertia_change." in said
    assert "The values are those with inertia_change: without it, J_M by -5 %." in said
    assert "with resolver_error" not in said
