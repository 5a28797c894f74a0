"""What a statement says of traces."""

from __future__ import annotations

from estimator.diagnosis.result import Effort, Fit, Slight, Verdict
from estimator.diagnosis.wording import Context, statement


def test_a_trace_says_what_it_does_to_the_values() -> None:
    fit = Fit("rad/s", 0.2, 0.05, 0.05, 0.05, 0.05, 0.05)
    still, moving = Slight("resolver_error", 0.001, {}), Slight("inertia_change", 0.002, {}, {"J_M": -0.05})
    said = statement(Verdict.NO_MISMATCH, fit, (), Effort(), Context(traces=(still, moving)))
    assert "Seen, but too small to matter: angle error of the resolver, step of the payload." in said
    assert "The values are those with step of the payload: without it, J_M by -5 %." in said
    assert "with angle error" not in said
