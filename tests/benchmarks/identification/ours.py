"""This project's estimators, as a user calls them."""

from __future__ import annotations

from estimator.errors import BadModel, EstimatorError
from estimator.identification.best import best_estimate
from estimator.identification.chain import OnlineChain
from estimator.identification.identify import identify
from estimator.identification.modes.modes import Mode
from estimator.identification.modes.physical import physical_parameters
from estimator.identification.modes.uncertainty import Uncertain, UncertainMode
from estimator.identification.offline.fits import LinearFit
from estimator.identification.settings import Settings
from tests.benchmarks.identification.answer import Answer, Case, Interval, Method
from tests.estimator.identification.driveline import uncertain_resonance

BEST, BATCH, RECURSIVE, TRACKED = "Box-Jenkins, 10 ms", "output error, 10 ms", "OEFO, 20 ms", "OEFO, tracked"


def printed(estimate: Uncertain) -> Interval:
    """Return an estimate as it is printed."""
    return Interval(estimate.value, *estimate.ci95, estimate.is_determined)


def of_mode(mode: UncertainMode | None, others: dict[str, Interval] | None = None) -> Answer:
    """Return a resonance with intervals as an answer."""
    if mode is None:
        return Answer(intervals=others or {}, refusal="no resonance")
    intervals = {"frequency": printed(mode.frequency_hz), "damping": printed(mode.damping)}
    return Answer(mode.frequency_hz.value, mode.damping.value, intervals | (others or {}))


def best(case: Case) -> Answer:
    """Return the best off-line estimate, at the recording's own period, and the two-mass drive behind it."""
    found = best_estimate(case.record)
    return of_mode(found.mode, _physical(found.two_mass))


def _physical(fit: LinearFit) -> dict[str, Interval]:
    try:
        found = physical_parameters(fit.model, fit.covariance)
    except BadModel:
        return {}
    both = {**found.parameters, **found.sums}
    return {name: printed(parameter.estimate) for name, parameter in both.items()}


def batch(case: Case) -> Answer:
    """Return the output-error model."""
    fit = identify(case.record).batch
    return of_mode(uncertain_resonance(fit.model, fit.covariance))


def recursive(case: Case) -> Answer:
    """Return the on-line model after the run, N = 1024."""
    return _of_mode(identify(case.record).online_resonance)


def _of_mode(mode: Mode | None) -> Answer:
    return Answer(refusal="no resonance") if mode is None else Answer(mode.frequency_hz, mode.damping)


def tracked(case: Case) -> Answer:
    """Return the resonance that is followed while driving, at the end of the run, with its intervals."""
    chain = OnlineChain(Settings(), case.record.sample_time_s, identify(case.record).L)
    last = chain.run(case.record)[-1]
    if last.resonance is None:
        return Answer(refusal="no resonance")
    mode = last.resonance
    return of_mode(
        UncertainMode(Uncertain(mode.frequency_hz, last.frequency_std_hz), Uncertain(mode.damping, last.damping_std))
    )


def refusing(method: Method) -> Method:
    """Return the method with its refusals as answers."""

    def answer(case: Case) -> Answer:
        try:
            return method(case)
        except EstimatorError as refusal:
            return Answer(refusal=f"{type(refusal).__name__}: {refusal}")

    return answer


OURS = {BEST: refusing(best), BATCH: refusing(batch), RECURSIVE: refusing(recursive), TRACKED: refusing(tracked)}
