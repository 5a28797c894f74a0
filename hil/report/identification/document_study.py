"""What questioning an identification adds to its entry in ``identification.json``."""

from __future__ import annotations

from typing import Any

from estimator.identification.modes.uncertainty import Uncertain
from estimator.identification.offline.fits import FreeRun
from estimator.identification.offline.validation import CorrelationTest
from estimator.identification.study import Study
from hil.report.identification.wording import best_statement, verdict
from hil.report.numbers import json_number


def studied(each: Study) -> dict[str, Any]:
    """Return intervals, third order, validation, feedback, cancellations, physical parameters; JSON types only."""
    return {
        "best": _best(each),
        "resonance_interval": None
        if each.resonance is None
        else {
            "frequency_hz": _uncertain(each.resonance.frequency_hz),
            "damping": _uncertain(each.resonance.damping),
        },
        "third_order": {
            "theta": each.third_order.model.theta.tolist(),
            "nk": each.third_order.model.nk,
            "poles": [[root.real, root.imag] for root in each.third_order.model.poles.tolist()],
            "zeros": [[root.real, root.imag] for root in each.third_order.model.zeros.tolist()],
            "largest_change": json_number(each.third_order.largest_error),
        },
        "validation": {
            "statement": each.validation.statement,
            "own": _free_run(each.validation.own),
            "unseen": [_free_run(run) for run in each.validation.unseen],
            "independence": _test(each.validation.independence),
            "autocorrelation": _test(each.validation.autocorrelation),
        },
        "feedback": {
            "detected": each.feedback.detected,
            "p_value": json_number(each.feedback.p_value),
            "statement": each.feedback.statement,
        },
        "cancellations": [
            {
                "pole": [one.pole.real, one.pole.imag],
                "zero": [one.zero.real, one.zero.imag],
                "p_value": json_number(one.p_value),
            }
            for one in each.roots.cancellations
        ],
        "physical": _physical(each),
    }


def _best(each: Study) -> dict[str, Any]:
    """Return the headline; frequency and damping are null where the data carry no pole pair."""
    best, mode = each.best, each.best.mode
    linearity = best.linearity
    return {
        "estimator": best.fit.method.value,
        "frequency_hz": None if mode is None else mode.frequency_hz.value,
        "damping": None if mode is None else mode.damping.value,
        "frequency_ci95_hz": None if mode is None else [json_number(end) for end in mode.frequency_hz.ci95],
        "damping_ci95": None if mode is None else [json_number(end) for end in mode.damping.ci95],
        "statement": best_statement(each),
        "verdict": best.verdict.value,
        "advice": verdict(each),
        "band_hz": list(best.band_hz),
        "order": best.fit.model.orders.na,
        "sample_time_s": best.fit.model.sample_time_s,
        "A": best.fit.model.A.tolist(),
        "B": best.fit.model.B.tolist(),
        "covariance": best.fit.covariance.tolist(),
        "independence": _test(best.validation.independence),
        "linearity": {
            "p_value": json_number(linearity.p_value),
            "linear": linearity.is_linear,
            "depends_on": None if linearity.is_linear else linearity.depends_on,
        },
        "by_shaft_torque": [
            {
                "low_nm": one.low,
                "high_nm": one.high,
                "frequency_hz": None if one.mode is None else one.mode.frequency_hz,
                "damping": None if one.mode is None else one.mode.damping,
            }
            for one in best.regions
        ],
    }


def _uncertain(estimate: Uncertain) -> dict[str, Any]:
    """Return a value with its standard deviation and interval; null where not finite."""
    return {
        "value": json_number(estimate.value),
        "std": json_number(estimate.std),
        "ci95": [json_number(end) for end in estimate.ci95],
    }


def _free_run(run: FreeRun) -> dict[str, Any]:
    return {
        "name": run.name,
        "rms": json_number(run.rms),
        "fit_percent": json_number(run.fit_percent),
        "one_step_fit_percent": json_number(run.one_step_fit_percent),
    }


def _test(test: CorrelationTest) -> dict[str, Any]:
    return {
        "lag": test.lag.tolist(),
        "correlation": [json_number(value) for value in test.correlation.tolist()],
        "bound": json_number(test.bound),
        "p_value": json_number(test.p_value),
    }


def _physical(each: Study) -> dict[str, Any]:
    if each.physical is None:
        return {"parameters": {}, "sums": {}, "reason": each.not_physical}
    groups = {"parameters": each.physical.parameters, "sums": each.physical.sums}
    content: dict[str, Any] = {
        group: {
            name: _uncertain(one.estimate)
            | {"unit": one.unit, "determined": one.is_determined, "statement": one.statement}
            for name, one in members.items()
        }
        for group, members in groups.items()
    }
    return content | {"reason": ""}
