"""Signs and scales: small pulses on each inverter, and both driven in turn by the same PRBS."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from drivers.plc.types import PrbsSource
from estimator.errors import NotExciting
from estimator.identification.settings import Settings
from estimator.signals.correlation import reading_lag
from estimator.signals.record import Record
from hil.commission.physical_fit import NATURAL_DELAY, DelaySelection, select_delay
from hil.commission.prbs_design import ResonanceSpread, resonance_spread
from hil.commission.responses import (
    READING,
    REFERENCE,
    Measured,
    PulseResponse,
    ResponseRatio,
    columns_of,
    pulse_response,
    record_of,
    response_ratio,
    thinned,
)
from hil.commission.state import StepFinding, model_json, stated
from hil.commission.step import Outcome, Step, StepContext
from hil.orders.order import Order, as_table, cruise_of, halt
from hil.recording.columns import SPEED, TIME
from hil.report.numbers import shown
from hil.rig.experiments.laws import LEAD_S, WAVE_STEPS

LEVELS = (0.05, 0.1, 0.2)
"""Heights of the pulses, in parts of an inverter's torque limit, each tried where the one before moved nothing."""

STEP_S = 1.0
WAVES = 4
DURATION_S_SIGNS = 2.0 * LEAD_S + WAVES * WAVE_STEPS * STEP_S

SHARES_M1 = {"m1": 1.0, "m2": 0.0}

SIZE = (0.5, 2.0)
"""Response over that of the rig file's inertia: it is roughly known, and a wrong scale is off by more."""

MOVES = 0.1
"""Part of that response that must surely be exceeded, or the vehicle counts as held: dry friction lets creep and noise
through, whose direction says nothing of the torque's sign."""

READING_SCALE = (0.98, 1.02)
"""Torque reading over its reference."""

SPARE_SPEED = 5.0
"""The run ends at so many times the speed expected, besides `SPARE_RAD_S`."""

SPARE_RAD_S = 0.5

DURATION_S_SCALES = 20.0

CRAWL = 0.15
"""Speed, in parts of that of the rig file's cruise: dry friction then has one sign, and nobody is driven far."""

PRBS_SHARE = 0.15
"""Amplitude, in parts of an inverter's torque limit; never above half of what the guard leaves a PRBS."""

BASE_SHARE = 0.5
"""Largest base torque, in parts of an inverter's torque limit."""

GAIN = (0.98, 1.02)
"""Torque of m2 over that of m1, for the same reading."""

DELAY_PERIODS = 0.1
"""How much later one inverter may act than the other, in sampling periods."""


@dataclass(frozen=True, slots=True)
class _Answer:
    """What one inverter answered: the pulses' height, the response, the course to draw."""

    step_nm: float
    response: PulseResponse
    course: dict[str, list[float]]

    @property
    def seen(self) -> bool:
        """Whether the vehicle surely moved."""
        return self.response.speed.exceeds(MOVES)


def _order_signs(job: StepContext, name: str, level: int) -> Order:
    limit_nm = min(getattr(job.rig.inverters, name).torque_limit_nm, job.rig.guard.sum_limit_nm)
    resolution_nm = 1e-3 * getattr(job.rig.inverters, name).rated_torque_nm
    step_nm = max(1, round(LEVELS[level] * limit_nm / resolution_nm)) * resolution_nm  # else its rounding is an error
    expected_rad_s = step_nm * STEP_S / job.rig.vehicle.inertia_kg_m2
    return Order(
        name if level == 0 else f"{name}-level{level + 1}",
        {
            "kind": "pulses",
            "duration_s": DURATION_S_SIGNS,
            "step_nm": step_nm,
            "step_s": STEP_S,
            "slew_nm_per_s": 0.5 * job.rig.guard.rate_limit_nm_per_s,
            "most_speed_rad_s": SPARE_SPEED * expected_rad_s + SPARE_RAD_S,
            "share_m1": SHARES_M1[name],
        },
        least_margin_rad_s=SPARE_SPEED * expected_rad_s + 2.0 * SPARE_RAD_S,
    )


def _orders_signs(job: StepContext) -> list[Order]:
    return [_order_signs(job, name, 0) for name in SHARES_M1]


def _about_signs(job: StepContext) -> str:
    largest = [f"{_order_signs(job, name, len(LEVELS) - 1).table['step_nm']:g} Nm" for name in SHARES_M1]
    return (
        "gives pulses of torque from standstill, both ways, with m1 alone and then with m2 alone; no speed controller "
        "takes part. Release the brakes. The vehicle moves by a hand's breadth and back. Where nothing moves, twice "
        f"and four times the torque follow, up to {' and '.join(largest)}."
    )


def _do_signs(job: StepContext) -> Outcome:
    findings: list[StepFinding] = []
    evidence = {}
    for name in SHARES_M1:
        answer = _ask(job, name)
        findings += _findings(name, answer)
        evidence[name] = {
            "step_nm": answer.step_nm,
            "speed": answer.response.speed,
            "reading": answer.response.reading,
            "course": answer.course,
        }
    return Outcome(findings, evidence)


def _ask(job: StepContext, name: str) -> _Answer:
    answer = _pulses(job, name, 0)
    for level in range(1, len(LEVELS)):
        if answer.seen:
            return answer
        job.say(
            f"  nothing seen to move with {answer.step_nm:g} Nm of {name}; again with {LEVELS[level]:.0%} of its limit"
        )
        answer = _pulses(job, name, level)
    return answer


def _pulses(job: StepContext, name: str, level: int) -> _Answer:
    order = _order_signs(job, name, level)
    columns = columns_of(job.recording(job.run("signs", order)))
    period_s = job.rig.period_s
    reference, reading, speed = columns[REFERENCE[name]], columns[READING[name]], columns[SPEED]
    response = pulse_response(
        reference,
        reading,
        speed,
        job.rig.vehicle.inertia_kg_m2,
        period_s,
        waves=WAVES,
        wave_samples=round(WAVE_STEPS * STEP_S / period_s),
        lead_samples=round(LEAD_S / period_s),
    )
    drawn = thinned(columns[TIME], reference, reading, speed)
    course = dict(zip(("time_s", "reference_nm", "reading_nm", "speed_rad_s"), drawn, strict=True))
    return _Answer(order.table["step_nm"], response, course)


def _findings(name: str, answer: _Answer) -> list[StepFinding]:
    speed, reading = answer.response.speed, answer.response.reading
    moves = "does not move" if not answer.seen else "forward" if speed.value > 0.0 else "backward"
    found = [
        StepFinding(
            f"{name}: torque reading over reference",
            f"{READING_SCALE[0]:g} to {READING_SCALE[1]:g}",
            reading.shown(),
            reading.is_within(*READING_SCALE),
            f"Compare rated torque (0x6076) and the sign of the current of {name} with the rig file",
            blocking=reading.value < 0.0,
        ),
        StepFinding(
            f"{name}: sign",
            "positive torque turns the motor forward (positive speed)",
            moves,
            answer.seen and speed.value > 0.0,
            f"Swap two phases of {name} or invert its polarity (0x607E); see that both inverters then agree"
            if answer.seen
            else f"Release the brakes, look whether {name} carries current, or raise its torque limit",
            blocking=True,
        ),
    ]
    if not answer.seen:
        return found
    size = StepFinding(
        f"{name}: size of the response",
        f"{SIZE[0]:g} to {SIZE[1]:g} of what the rig file's inertia says",
        speed.shown(),
        speed.is_within(*SIZE),
        "Correct [vehicle] inertia_kg_m2, or look for a wrong scale of torque or speed, a brake, dry friction",
    )
    return [*found, size, stated(f"{name}: torque of the pulses", f"{answer.step_nm:g} Nm")]


SIGNS = Step("signs", "Signs and sizes", _about_signs, _do_signs, _orders_signs, needs=("devices", "limits"))


@dataclass(frozen=True, slots=True)
class _Test:
    """One inverter by itself."""

    record: Record
    reading_gain: float
    lag: int
    delay: DelaySelection
    spread: ResonanceSpread | None


def _amplitude_nm(job: StepContext, name: str) -> float:
    limit_nm = getattr(job.rig.inverters, name).torque_limit_nm
    return float(min(PRBS_SHARE * limit_nm, 0.5 * job.rig.guard.prbs_limit_nm))


def _order_scales(job: StepContext, name: str) -> Order:
    cruise = cruise_of(job.rig)
    limit_nm = min(getattr(job.rig.inverters, name).torque_limit_nm, job.rig.guard.sum_limit_nm)
    table = as_table(
        cruise,
        speed_rad_s=CRAWL * cruise.speed_rad_s,
        duration_s=DURATION_S_SCALES,
        torque_nm=min(cruise.torque_nm, BASE_SHARE * limit_nm),
        slew_nm_per_s=min(cruise.slew_nm_per_s, job.rig.guard.rate_limit_nm_per_s),
        share_m1=SHARES_M1[name],
        prbs=True,
    )
    # a PLC gives both drives a part, as it was programmed; here one alone is to move
    prbs = {"amplitude_nm": _amplitude_nm(job, name), "target": name, "share_m1": None, "source": PrbsSource.HOST.value}
    return Order(name, table, prbs)


def _orders_scales(job: StepContext) -> list[Order]:
    return [*(_order_scales(job, name) for name in SHARES_M1), halt(job.rig)]


def _about_scales(job: StepContext) -> str:
    speed = CRAWL * cruise_of(job.rig).speed_rad_s
    return (
        f"brings the vehicle to {speed:g} rad/s with m1 alone and gives it a small PRBS, then the same with m2 alone, "
        "and brings it to a stand. From the two: scale of each torque reading, delay of each, gain of one against the "
        "other."
    )


def _do_scales(job: StepContext) -> Outcome:
    runs = [job.run("scales", order) for order in _orders_scales(job)]
    tests = {run.name: _test(job, run.name) for run in runs if run.name in SHARES_M1}
    first, second = tests["m1"], tests["m2"]
    ratio = response_ratio(first.record, second.record)
    findings = [finding for name, test in tests.items() for finding in _own_findings(name, test)]
    findings += _mutual_findings(ratio, job.rig.period_s)
    evidence: dict[str, Any] = {
        "gain": ratio.gain,
        "delay_s": ratio.delay_s,
        "extra_samples": max(first.delay.extra_samples, second.delay.extra_samples),
        "amplitude_nm": _amplitude_nm(job, "m1"),
        "duration_s": DURATION_S_SCALES,
    }
    if first.spread is not None:
        mode = first.spread.mode
        findings.append(
            stated("resonance, a first look", f"{shown(mode.frequency_hz, 'Hz')}, damping {mode.damping:.3f}")
        )
        evidence["resonance"] = [mode.frequency_hz, mode.damping]
        evidence["spread"] = [first.spread.frequency_std, first.spread.damping_std]
        from hil.commission.physical_fit import fit_two_mass  # half a second, and the bus comes first

        rough = fit_two_mass([first.record, second.record], job.rig.vehicle.inertia_kg_m2, mode)
        evidence["model"] = model_json(rough.model)
    else:
        findings.append(
            StepFinding(
                "resonance, a first look",
                f"a lightly damped mode between {Settings().band_hz[0]:g} and {Settings().band_hz[1]:g} Hz",
                "none",
                False,
                "Raise the torque limits a little and repeat, or look at other frequencies: hil identify --help",
            )
        )
    return Outcome(findings, evidence)


def _test(job: StepContext, name: str) -> _Test:
    run = job.state.steps["scales"].run(name)
    if run is None:
        raise ValueError(f"step scales: run {name} was ordered and is not there")
    path = job.recording(run)
    columns, record = columns_of(path), record_of(path)
    reading, reference = columns[READING[name]], columns[REFERENCE[name]]
    lag = reading_lag(reading, reference)
    n = reading.shape[0] - lag
    both = np.column_stack([reference[:n], np.ones(n)])
    gain = float(np.linalg.lstsq(both, reading[lag:], rcond=None)[0][0])
    try:
        delay = select_delay(record)
    except NotExciting as error:
        raise NotExciting(f"{error} Is {name} armed, and does its torque reach the shaft?", error.names) from error
    return _Test(record, gain, lag, delay, resonance_spread(delay.fit, Settings().band_hz))


def _own_findings(name: str, test: _Test) -> list[StepFinding]:
    extra = test.delay.extra_samples
    period_ms = 1e3 * test.record.sample_time_s
    return [
        StepFinding(
            f"{name}: torque reading over reference",
            f"{GAIN[0]:g} to {GAIN[1]:g}",
            f"{test.reading_gain:.4f}, {test.lag} samples behind",
            GAIN[0] <= test.reading_gain <= GAIN[1],
            f"Compare rated torque (0x6076) and torque limits of {name} with the rig file",
        ),
        StepFinding(
            f"{name}: delay from torque reading to speed",
            "the one sample that sampling makes",
            f"{extra + NATURAL_DELAY} samples, {extra} more ({extra * period_ms:g} ms)" if extra else "that one",
            extra == 0,
            "Look for a filter or dead time in drive, bus or resolver; the diagnosis takes it into account",
        ),
    ]


def _mutual_findings(ratio: ResponseRatio, period_s: float) -> list[StepFinding]:
    gain, delay = ratio.gain, ratio.delay_s
    limit_ms = 1e3 * DELAY_PERIODS * period_s
    difference = Measured(gain.value - 1.0, gain.ci95)
    return [
        StepFinding(
            "m2 against m1: gain, for the same reading",
            f"equal within ±{100.0 * (GAIN[1] - 1.0):g} %",
            f"m2 gives {difference.shown_as('more', 'less', '%', 100.0)}",
            gain.is_within(*GAIN),
            "Calibrate one against a torque transducer or a known inertia: no test here shows which is right",
            blocking=gain.value < 0.0,
        ),
        StepFinding(
            "m2 against m1: delay",
            f"equal within ±{limit_ms:g} ms",
            f"m2 acts {delay.shown_as('later', 'earlier', 'ms', 1e3)}",
            delay.is_within(-1e-3 * limit_ms, 1e-3 * limit_ms),
            "Compare cycle times, torque filters and transmission types of both drives",
        ),
    ]


SCALES = Step("scales", "Scales and delays", _about_scales, _do_scales, _orders_scales, needs=("signs",))
