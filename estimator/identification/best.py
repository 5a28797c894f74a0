"""The best estimate of a recording: a pole pair that the data need, its intervals, and whether to believe it.

A Box-Jenkins model at the recording's own period, where the torque was held from one sample to the next. Its order is
that of two masses, three, and is raised only where the residual still depends on past torque. The pair is given where
the data pay for it (a model without is worse by the Bayesian criterion), where no zero cancels it, and where its
frequency is known to better than a half.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np

from estimator.identification.linear_model import LinearModel, Orders
from estimator.identification.modes.modes import Cancellation, UncertainMode, pole_zero_map, uncertain_modes
from estimator.identification.modes.physical import RESPONDING
from estimator.identification.offline.fits import LinearFit, fit_of, solved
from estimator.identification.offline.linearity import (
    Linearity,
    RegionalMode,
    judge_linearity,
    modes_by_region,
    shaft_torque,
)
from estimator.identification.offline.problem import Problem
from estimator.identification.offline.validation import Feedback, Validation, criterion, judge_feedback, validate
from estimator.signals.decimate import HIGH_PASS_HZ, block_of, first_part, high_passed
from estimator.signals.record import FloatArray, Record

RIGID = Orders(1, 1, 1)  # one mass: the model that a pole pair has to be better than

RICHER = (Orders(4, 4, 1), Orders(5, 5, 1))
"""Tried where two masses miss a part of the response: a lag or a further delay, a third mass."""

SEEN = 0.8
"""Part of half the sampling rate up to which a mode is looked for: above, its samples say little of its damping."""

LOWEST_HZ, HIGHEST_HZ = 2.0, 50.0
"""Below, road and driver move the speed; above lie no resonances of drivelines (the paper's band ends there)."""

SAMPLES_PER_PERIOD = 4.0
"""Fewer samples in one period of the resonance leave its damping to the low-pass of the sampling."""

MOST_UNCERTAIN = 0.5  # largest half width of the frequency's 95 % interval, in parts of it


ONE_MASS_DOES = "one mass explains the recording as well: the data do not need a pole pair"
"""The reason for no pole pair that is a finding about the drive."""


class ModelVerdict(Enum):
    """What a reader may do with the linear model; the value is its name in files."""

    GOOD = "model_good"
    NOT_LINEAR = "not_linear"
    CLOSED_LOOP = "closed_loop"
    NOT_EXCITED = "not_excited"
    INCOMPLETE = "incomplete"
    ONE_MASS = "one_mass"


@dataclass(frozen=True, slots=True, eq=False)
class BestEstimate:
    """The headline of one recording."""

    fit: LinearFit  # the Box-Jenkins model it is taken from
    two_mass: LinearFit  # the one of third order, which physical parameters are taken from
    problem: Problem  # the least-squares problem of `fit`
    x: FloatArray  # its minimum
    mode: UncertainMode | None  # the pole pair, None where the data carry none
    reason: str  # why there is none
    band_hz: tuple[float, float]  # where it was looked for [Hz]
    validation: Validation  # of the fit on its recording
    feedback: Feedback  # whether the torque followed the speed
    linearity: Linearity  # whether a linear model is enough
    regions: tuple[RegionalMode, ...]  # the resonance by region of the shaft's torque [Nm]; empty where linear
    verdict: ModelVerdict  # whether it may be believed, and if not, why

    @property
    def too_slow(self) -> bool:
        """Whether the sampling is too slow: fewer than SAMPLES_PER_PERIOD samples in a period of the resonance."""
        period_s = self.fit.model.sample_time_s
        return self.mode is not None and self.mode.frequency_hz.value * period_s > 1.0 / SAMPLES_PER_PERIOD


@dataclass(frozen=True, slots=True, eq=False)
class _Rung:
    """One order tried: its problem, minimum and fit."""

    problem: Problem  # with these orders
    x: FloatArray  # its minimum
    first: int  # first sample that counts
    fit: LinearFit  # the model at the minimum
    validation: Validation  # of the fit on its own recording


def best_estimate(record: Record, high_pass_hz: float = HIGH_PASS_HZ) -> BestEstimate:
    """Return the headline of a recording: the Box-Jenkins model with the orders that the criterion prefers."""
    record = first_part(record)
    data = high_passed(record, high_pass_hz)
    rungs = [_rung(data, RESPONDING)]
    if not rungs[0].validation.independence.is_independent:
        rungs += [_rung(data, orders) for orders in RICHER]
    chosen = min(rungs, key=lambda rung: criterion(rung.fit))
    band_hz = band_of(record)
    mode, reason = _needed_pair(chosen.fit, band_hz, _rung(data, RIGID).fit)
    linearity = judge_linearity(chosen.problem, chosen.x, record, chosen.first, high_pass_hz)
    feedback = judge_feedback(chosen.validation)
    regions: tuple[RegionalMode, ...] = ()
    if not linearity.is_linear:
        signal = shaft_torque(chosen.fit.model, record.total_torque_nm[chosen.first :])
        regions = modes_by_region(chosen.problem, chosen.x, signal, band_hz)
    return BestEstimate(
        fit=chosen.fit,
        two_mass=rungs[0].fit,
        problem=rungs[0].problem,
        x=rungs[0].x,
        mode=mode,
        reason=reason,
        band_hz=band_hz,
        validation=chosen.validation,
        feedback=feedback,
        linearity=linearity,
        regions=regions,
        verdict=_verdict(mode, reason, chosen.validation, feedback, linearity),
    )


def band_of(record: Record) -> tuple[float, float]:
    """Return where a recording's resonance is looked for [Hz]."""
    period_s = record.sample_time_s * block_of(record.sample_time_s)
    return LOWEST_HZ, min(HIGHEST_HZ, SEEN * 0.5 / period_s)


def _rung(data: Record, orders: Orders) -> _Rung:
    problem, x, first = solved(data, orders)
    fit = fit_of(problem, x, first)
    return _Rung(problem, x, first, fit, validate(fit, data))


def _needed_pair(fit: LinearFit, band_hz: tuple[float, float], rigid: LinearFit) -> tuple[UncertainMode | None, str]:
    """Return the pair of the highest peak that the data need, or why there is none."""
    mode, reason = known_pair(fit.model, fit.covariance, band_hz)
    has_pair = mode is not None or reason != _no_pair(band_hz)
    return (None, ONE_MASS_DOES) if has_pair and criterion(rigid) <= criterion(fit) else (mode, reason)


def _within(band_hz: tuple[float, float]) -> str:
    return f"between {band_hz[0]:g} and {band_hz[1]:.3g} Hz"


def _no_pair(band_hz: tuple[float, float]) -> str:
    return f"the model has no oscillating pole pair {_within(band_hz)}"


def known_pair(
    model: LinearModel, covariance: FloatArray, band_hz: tuple[float, float]
) -> tuple[UncertainMode | None, str]:
    """Return the pair of the highest peak that no zero cancels and whose frequency is known, or why there is none."""
    low, high = band_hz
    pairs = [each for each in uncertain_modes(model, covariance) if low <= each.frequency_hz.value <= high]
    if not pairs:
        return None, _no_pair(band_hz)
    cancelled = [_frequency_hz(one, model) for one in pole_zero_map(model, covariance).cancellations]
    needed = [each for each in pairs if not np.isclose(each.frequency_hz.value, cancelled, rtol=1e-6).any()]
    if not needed:
        return None, f"the pole pair at {pairs[0].frequency_hz.value:.3g} Hz and a pair of zeros can't be distinguished"
    sure = [each for each in needed if _half_width(each) <= MOST_UNCERTAIN * each.frequency_hz.value]
    if not sure:
        return None, f"a pole pair {_within(band_hz)} is there, its frequency not known to better than a half"
    return sure[0], ""


def _frequency_hz(one: Cancellation, model: LinearModel) -> float:
    return float(abs(np.log(one.pole)) / (2.0 * np.pi * model.sample_time_s)) if one.pole.imag else 0.0


def _half_width(mode: UncertainMode) -> float:
    low, high = mode.frequency_hz.ci95
    return (high - low) / 2.0


def _verdict(
    mode: UncertainMode | None, reason: str, validation: Validation, feedback: Feedback, linearity: Linearity
) -> ModelVerdict:
    """Name what matters most; a nonlinear drive also looks like feedback, so that it comes first."""
    if mode is None:
        return ModelVerdict.ONE_MASS if reason == ONE_MASS_DOES else ModelVerdict.NOT_EXCITED
    if not linearity.is_linear:
        return ModelVerdict.NOT_LINEAR
    if not validation.independence.is_independent:
        return ModelVerdict.INCOMPLETE
    return ModelVerdict.CLOSED_LOOP if feedback.detected else ModelVerdict.GOOD
