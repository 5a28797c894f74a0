"""PRBS amplitude: large enough for the resonance, small enough for limits, speed band and those on board.

Predicted from the small PRBS of the scales step and from the driveline as far as it is known; then driven once and
measured. Where the measurement says otherwise the amplitude is changed, twice at most.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from estimator.errors import NotExciting
from estimator.identification.linear_model import Orders
from estimator.identification.modes.modes import Mode
from estimator.identification.settings import Settings
from estimator.signals.decimate import decimate
from estimator.signals.record import FloatArray, Record
from hil.commission import prbs_design as amplitude
from hil.commission.prbs_design import (
    COMFORT_LIMIT_M_S2,
    DAMPING_STD,
    FREQUENCY_STD,
    Cap,
    Choice,
    ResonanceSpread,
    resonance_spread,
    vibration_m_s2,
)
from hil.commission.responses import HIGH_PASS_HZ, RINGING_S, averaged, record_of
from hil.commission.state import StepFinding
from hil.commission.step import Outcome, Step, StepContext
from hil.orders.order import Order, as_table, cruise_of, halt
from hil.orders.runner import RunRecord
from hil.report.numbers import shown

SPEED_BAND = 0.1
"""A speed is nearly constant within so much of it, either way."""

LEAST_BAND_RAD_S = 2.0

TRIES = 3


@dataclass(frozen=True, slots=True)
class _TrialResult:
    """What a trial showed, or is predicted to show."""

    spread: ResonanceSpread | None
    vibration_m_s2: float
    low_rad_s: float
    high_rad_s: float


def _order(job: StepContext, amplitude_nm: float, number: int = 1) -> Order:
    table = as_table(cruise_of(job.rig), prbs=True)
    return Order(f"trial{number}", table, {"amplitude_nm": amplitude_nm})


def _orders(job: StepContext) -> list[Order]:
    return [_order(job, _choice(job).amplitude_nm), halt(job.rig)]


def _about(job: StepContext) -> str:
    choice = _choice(job)
    return (
        f"drives at {cruise_of(job.rig).speed_rad_s:g} rad/s with a PRBS of ±{choice.amplitude_nm:g} Nm of both "
        f"inverters together ({choice.reason}), measures, and corrects the amplitude if needed."
    )


def _choice(job: StepContext) -> Choice:
    """Choose the amplitude from what is known before it was driven."""
    caps = [*amplitude.torque_caps(job.rig), *_comfort_cap(job)]
    known = _known_spread(job)
    needed = 0.0 if known is None else _needed(job, known)
    return amplitude.choose(job.rig.prbs.amplitude_nm, needed, caps, _resolution_nm(job))


def _needed(job: StepContext, known: ResonanceSpread) -> float:
    return amplitude.needed_nm(known, _test_amplitude_nm(job))


def _test_amplitude_nm(job: StepContext) -> float:
    """Return the amplitude of the scales step, were its test as long as the runs to come [Nm].

    Spreads are inverse to the amplitude and to the root of the length.
    """
    scales = job.evidence("scales")
    return float(scales["amplitude_nm"] / math.sqrt(cruise_of(job.rig).duration_s / scales["duration_s"]))


def _known_spread(job: StepContext) -> ResonanceSpread | None:
    scales = job.evidence("scales")
    if "spread" not in scales:
        return None
    return ResonanceSpread(Mode(*scales["resonance"]), *scales["spread"])


def _resolution_nm(job: StepContext) -> float:
    """Return the step of the drives' torque, of both together [Nm]: one per mille of rated torque each."""
    return 1e-3 * (job.rig.inverters.m1.rated_torque_nm + job.rig.inverters.m2.rated_torque_nm)


def _comfort_cap(job: StepContext) -> Iterator[Cap]:
    """Predict the vibration with the rig file's amplitude; it grows with it."""
    if not job.evidence("scales").get("model") and job.nominal is None:
        return
    seen = _predicted(job, job.rig.prbs.amplitude_nm)
    if seen.vibration_m_s2 > 0.0:
        yield Cap(job.rig.prbs.amplitude_nm * COMFORT_LIMIT_M_S2 / seen.vibration_m_s2, "the comfort of those on board")


def _predicted(job: StepContext, amplitude_nm: float) -> _TrialResult:
    prediction = job.predict(_order(job, amplitude_nm))
    vibration = vibration_m_s2(
        prediction.torque_nm, prediction.course_rad_s, job.model(), job.rig.period_s, job.travel_m_per_rad
    )
    known = _known_spread(job)
    if known is not None:
        known = known.scaled(_test_amplitude_nm(job) / amplitude_nm)
    return _TrialResult(known, vibration, *_course(prediction.course_rad_s, job.rig.period_s))


def _do(job: StepContext) -> Outcome:
    choice = _choice(job)
    tries: list[dict[str, Any]] = []
    for number in range(1, TRIES + 1):
        predicted = _predicted(job, choice.amplitude_nm)
        run = job.run("prbs", _order(job, choice.amplitude_nm, number))
        seen = _measured(job, run)
        tries.append({"amplitude_nm": choice.amplitude_nm, "predicted": _json(predicted), "measured": _json(seen)})
        better = _better(job, choice, seen)
        if number == TRIES or better is None:
            break
        job.say(f"  ±{choice.amplitude_nm:g} Nm was {better.reason}: again with ±{better.amplitude_nm:g} Nm")
        choice = better
    job.run("prbs", halt(job.rig))
    evidence = {"amplitude_nm": choice.amplitude_nm, "reason": choice.reason, "tries": tries}
    return Outcome(_findings(job, choice, predicted, seen, run), evidence)


def _measured(job: StepContext, run: RunRecord) -> _TrialResult:
    record = record_of(job.recording(run))
    speed = np.interp(record.time_s, record.time_s[record.okay], record.output[record.okay])
    vibration = vibration_m_s2(record.total_torque_nm, speed, job.model(), record.sample_time_s, job.travel_m_per_rad)
    return _TrialResult(_spread(job, record), vibration, *_course(speed, record.sample_time_s))


def _course(speed_rad_s: FloatArray, period_s: float) -> tuple[float, float]:
    """Return the range of the vehicle's own speed [rad/s]: the motor's, with what rings averaged out."""
    smooth = averaged(speed_rad_s, RINGING_S, period_s)
    return float(smooth.min()), float(smooth.max())


def _spread(job: StepContext, record: Record) -> ResonanceSpread | None:
    from estimator.identification.offline.fits import fit_output_error  # half a second, and the bus comes first

    extra = int(job.evidence("scales").get("extra_samples") or 0)
    try:
        fit = fit_output_error(decimate(record, 1, HIGH_PASS_HZ), Orders(nk=1 + extra))
    except NotExciting:
        return None
    return resonance_spread(fit, Settings().band_hz)


def _better(job: StepContext, choice: Choice, seen: _TrialResult) -> Choice | None:
    """Return another amplitude where what was measured asks for one."""
    step_nm = _resolution_nm(job)
    if seen.vibration_m_s2 > COMFORT_LIMIT_M_S2:
        share = COMFORT_LIMIT_M_S2 / seen.vibration_m_s2
        lower = math.floor(0.95 * share * choice.amplitude_nm / step_nm) * step_nm
        return replace(choice, amplitude_nm=lower, reason="too much for those on board") if lower > 0.0 else None
    excess = 2.0 if seen.spread is None else amplitude.excess(seen.spread)
    if excess <= 1.0:
        return None
    caps = [*amplitude.torque_caps(job.rig), *_comfort_cap(job)]
    wanted = 1.2 * excess * choice.amplitude_nm
    higher = amplitude.choose(wanted, wanted, caps, step_nm)
    if higher.amplitude_nm <= choice.amplitude_nm:
        return None
    return replace(higher, reason="too little for the resonance")


def _findings(
    job: StepContext, choice: Choice, predicted: _TrialResult, seen: _TrialResult, run: RunRecord
) -> list[StepFinding]:
    speed = cruise_of(job.rig).speed_rad_s
    band = max(LEAST_BAND_RAD_S, SPEED_BAND * abs(speed))
    inside = speed - band <= seen.low_rad_s and seen.high_rad_s <= speed + band
    travel = "" if job.travel_is_given else f" (with {job.travel_m_per_rad:.3g} m per motor radian, assumed)"
    weaker = f"The cap is {choice.cap.amplitude_nm:g} Nm, set by {choice.cap.reason}: raise it, or drive longer runs"
    return [
        StepFinding(
            "amplitude of the PRBS",
            f"at least {choice.needed_nm:.0f} Nm, at most {choice.cap.amplitude_nm:.0f} Nm ({choice.cap.reason})",
            f"±{choice.amplitude_nm:g} Nm, {choice.reason}",
            choice.needed_nm <= choice.amplitude_nm <= choice.cap.amplitude_nm + 1e-9,
            weaker,
        ),
        *_spread_findings(predicted.spread, seen.spread, weaker),
        StepFinding(
            "vibration of the vehicle (RMS)",
            f"at most {COMFORT_LIMIT_M_S2:g} m/s² (ISO 2631-1){travel}",
            f"{seen.vibration_m_s2:.3f} m/s², predicted {predicted.vibration_m_s2:.3f}",
            seen.vibration_m_s2 <= COMFORT_LIMIT_M_S2,
            "Lower [prbs] amplitude_nm; give the vehicle's own way per motor radian by --travel",
        ),
        StepFinding(
            "speed while measured",
            f"{speed - band:g} to {speed + band:g} rad/s",
            f"{seen.low_rad_s:.1f} to {seen.high_rad_s:.1f}, predicted {predicted.low_rad_s:.1f} to "
            f"{predicted.high_rad_s:.1f}",
            inside,
            "Look for a level road without wind, or lower the amplitude",
        ),
        _room(job, run),
    ]


def _spread_findings(
    predicted: ResonanceSpread | None, seen: ResonanceSpread | None, advice: str
) -> Iterator[StepFinding]:
    def written(value: float | None) -> str:
        return "" if value is None else f", predicted {shown(100.0 * value, '%')}"

    if seen is None:
        yield StepFinding("resonance in one run", "a lightly damped mode", "none found", False, advice)
        return
    yield StepFinding(
        "standard deviation of the resonance's frequency, one run",
        f"at most {100.0 * FREQUENCY_STD:g} %",
        f"{shown(100.0 * seen.frequency_std, '%')} of {shown(seen.mode.frequency_hz, 'Hz')}"
        + written(None if predicted is None else predicted.frequency_std),
        seen.frequency_std <= FREQUENCY_STD,
        advice,
    )
    yield StepFinding(
        "standard deviation of its damping, one run",
        f"at most {100.0 * DAMPING_STD:g} %",
        f"{shown(100.0 * seen.damping_std, '%')} of {seen.mode.damping:.3f}"
        + written(None if predicted is None else predicted.damping_std),
        seen.damping_std <= DAMPING_STD,
        advice,
    )


def _room(job: StepContext, run: RunRecord) -> StepFinding:
    """Hold the largest torque that was measured against the limits of the rig file."""
    largest = {name: max(map(abs, run.measured[f"torque_{name}_nm"])) for name in ("m1", "m2")}
    limits = {name: getattr(job.rig.inverters, name).torque_limit_nm for name in largest}
    return StepFinding(
        "largest torque of each inverter",
        " and ".join(f"{name} at most {limit:g} Nm" for name, limit in limits.items()),
        " and ".join(f"{name} {shown(value, 'Nm')}" for name, value in largest.items()),
        all(largest[name] <= limits[name] * 1.01 for name in largest),  # 1 %: the reading's own noise and scale
        "A reading beyond what was commanded: look at its scale",
    )


def _json(seen: _TrialResult) -> dict[str, Any]:
    spread = seen.spread
    return {
        "frequency_std": None if spread is None else spread.frequency_std,
        "damping_std": None if spread is None else spread.damping_std,
        "vibration_m_s2": seen.vibration_m_s2,
        "speed_rad_s": [seen.low_rad_s, seen.high_rad_s],
    }


PRBS = Step("prbs", "Amplitude of the PRBS", _about, _do, _orders, needs=("noise", "scales"))
