"""Scales and delays: a small PRBS on each inverter by itself, at a crawl, and one held against the other."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from estimator.errors import NotExciting
from estimator.identification.settings import Settings
from estimator.signals.record import Record
from hil.commission.analysis.delay_selection import NATURAL_DELAY, DelaySelection, select_delay
from hil.commission.analysis.pulse_response import reading_lag
from hil.commission.analysis.resonance_spread import ResonanceSpread, resonance_spread
from hil.commission.analysis.response_ratio import ResponseRatio, response_ratio
from hil.commission.finding import Finding, stated
from hil.commission.model_json import model_json
from hil.commission.order import Order, as_table
from hil.commission.readings import READING, REFERENCE, columns_of, record_of
from hil.commission.step import Job, Outcome, Step
from hil.commission.steps.tables import cruise_of, halt
from hil.report.numbers import shown

DURATION_S = 20.0

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

SHARES = {"m1": 1.0, "m2": 0.0}


@dataclass(frozen=True, slots=True)
class _Test:
    """One inverter by itself."""

    record: Record
    reading_gain: float
    lag: int
    delay: DelaySelection
    spread: ResonanceSpread | None


def _amplitude_nm(job: Job, name: str) -> float:
    limit_nm = getattr(job.rig.inverters, name).torque_limit_nm
    return float(min(PRBS_SHARE * limit_nm, 0.5 * job.rig.guard.prbs_limit_nm))


def _order(job: Job, name: str) -> Order:
    cruise = cruise_of(job.rig)
    limit_nm = min(getattr(job.rig.inverters, name).torque_limit_nm, job.rig.guard.sum_limit_nm)
    table = as_table(
        cruise,
        speed_rad_s=CRAWL * cruise.speed_rad_s,
        duration_s=DURATION_S,
        torque_nm=min(cruise.torque_nm, BASE_SHARE * limit_nm),
        slew_nm_per_s=min(cruise.slew_nm_per_s, job.rig.guard.rate_limit_nm_per_s),
        share_m1=SHARES[name],
        prbs=True,
    )
    prbs = {"amplitude_nm": _amplitude_nm(job, name), "target": name, "share_m1": None}
    return Order(name, table, prbs)


def _orders(job: Job) -> list[Order]:
    return [*(_order(job, name) for name in SHARES), halt(job.rig)]


def _about(job: Job) -> str:
    speed = CRAWL * cruise_of(job.rig).speed_rad_s
    return (
        f"brings the vehicle to {speed:g} rad/s with m1 alone and gives it a small PRBS, then the same with m2 alone, "
        "and brings it to a stand. From the two: scale of each torque reading, delay of each, gain of one against the "
        "other."
    )


def _do(job: Job) -> Outcome:
    runs = [job.run("scales", order) for order in _orders(job)]
    tests = {run.name: _test(job, run.name) for run in runs if run.name in SHARES}
    first, second = tests["m1"], tests["m2"]
    ratio = response_ratio(first.record, second.record)
    findings = [finding for name, test in tests.items() for finding in _own_findings(name, test)]
    findings += _mutual_findings(ratio, job.rig.period_s)
    evidence: dict[str, Any] = {
        "gain": [ratio.gain.value, ratio.gain.ci95],
        "delay_s": [ratio.delay_s.value, ratio.delay_s.ci95],
        "extra_samples": max(first.delay.extra_samples, second.delay.extra_samples),
        "amplitude_nm": _amplitude_nm(job, "m1"),
        "duration_s": DURATION_S,
    }
    if first.spread is not None:
        mode = first.spread.mode
        findings.append(
            stated("resonance, a first look", f"{shown(mode.frequency_hz, 'Hz')}, damping {mode.damping:.3f}")
        )
        evidence["resonance"] = [mode.frequency_hz, mode.damping]
        evidence["spread"] = [first.spread.frequency_std, first.spread.damping_std]
        from hil.commission.analysis.physical_fit import fit_two_mass  # half a second, and the bus comes first

        rough = fit_two_mass([first.record, second.record], job.rig.vehicle.inertia_kg_m2, mode)
        evidence["model"] = model_json(rough.model)
    else:
        findings.append(
            Finding(
                "resonance, a first look",
                f"a lightly damped mode between {Settings().band_hz[0]:g} and {Settings().band_hz[1]:g} Hz",
                "none",
                False,
                "Raise the torque limits a little and repeat, or look at other frequencies: hil identify --help",
            )
        )
    return Outcome(findings, evidence)


def _test(job: Job, name: str) -> _Test:
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


def _own_findings(name: str, test: _Test) -> list[Finding]:
    extra = test.delay.extra_samples
    period_ms = 1e3 * test.record.sample_time_s
    return [
        Finding(
            f"{name}: torque reading over reference",
            f"{GAIN[0]:g} to {GAIN[1]:g}",
            f"{test.reading_gain:.4f}, {test.lag} samples behind",
            GAIN[0] <= test.reading_gain <= GAIN[1],
            f"Compare rated torque (0x6076) and torque limits of {name} with the rig file",
        ),
        Finding(
            f"{name}: delay from torque reading to speed",
            "the one sample that sampling makes",
            f"{extra + NATURAL_DELAY} samples, {extra} more ({extra * period_ms:g} ms)" if extra else "that one",
            extra == 0,
            "Look for a filter or dead time in drive, bus or resolver; the diagnosis takes it into account",
        ),
    ]


def _mutual_findings(ratio: ResponseRatio, period_s: float) -> list[Finding]:
    gain, delay = ratio.gain, ratio.delay_s
    limit_ms = 1e3 * DELAY_PERIODS * period_s
    difference = type(gain)(gain.value - 1.0, gain.ci95)
    return [
        Finding(
            "m2 against m1: gain, for the same reading",
            f"equal within ±{100.0 * (GAIN[1] - 1.0):g} %",
            f"m2 gives {difference.shown_as('more', 'less', '%', 100.0)}",
            gain.is_within(*GAIN),
            "Calibrate one against a torque transducer or a known inertia: no test here shows which is right",
            blocking=gain.value < 0.0,
        ),
        Finding(
            "m2 against m1: delay",
            f"equal within ±{limit_ms:g} ms",
            f"m2 acts {delay.shown_as('later', 'earlier', 'ms', 1e3)}",
            delay.is_within(-1e-3 * limit_ms, 1e-3 * limit_ms),
            "Compare cycle times, torque filters and transmission types of both drives",
        ),
    ]


STEP = Step("scales", "Scales and delays", _about, _do, _orders, needs=("signs",))
