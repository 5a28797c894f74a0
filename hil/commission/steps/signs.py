"""Signs and sizes: small pulses from standstill, one inverter at a time, without a speed controller.

Begins small; where nothing is seen to move, continues with twice and four times as much.
"""

from __future__ import annotations

from dataclasses import dataclass

from hil.commission.analysis.pulse_response import PulseResponse, pulse_response
from hil.commission.finding import Finding, stated
from hil.commission.order import Order
from hil.commission.readings import READING, REFERENCE, columns_of, thinned
from hil.commission.step import Job, Outcome, Step
from hil.recording.columns import SPEED, TIME
from hil.rig.experiments.pulses import LEAD_S, WAVE_STEPS

LEVELS = (0.05, 0.1, 0.2)
"""Heights of the pulses, in parts of an inverter's torque limit, each tried where the one before moved nothing."""

STEP_S = 1.0
WAVES = 4
DURATION_S = 2.0 * LEAD_S + WAVES * WAVE_STEPS * STEP_S

SHARES = {"m1": 1.0, "m2": 0.0}

SIZE = (0.5, 2.0)
"""Response over that of the rig file's inertia: it is roughly known, and a wrong scale is off by more."""

READING_SCALE = (0.98, 1.02)
"""Torque reading over its reference."""

SPARE_SPEED = 5.0
"""The run ends at so many times the speed expected, besides `SPARE_RAD_S`."""

SPARE_RAD_S = 0.5


@dataclass(frozen=True, slots=True)
class _Answer:
    """What one inverter answered: the pulses' height, the response, the course to draw."""

    step_nm: float
    response: PulseResponse
    course: dict[str, list[float]]

    @property
    def seen(self) -> bool:
        return self.response.speed.is_seen


def _order(job: Job, name: str, level: int) -> Order:
    limit_nm = min(getattr(job.rig.inverters, name).torque_limit_nm, job.rig.guard.sum_limit_nm)
    resolution_nm = 1e-3 * getattr(job.rig.inverters, name).rated_torque_nm
    step_nm = max(1, round(LEVELS[level] * limit_nm / resolution_nm)) * resolution_nm  # else its rounding is an error
    expected_rad_s = step_nm * STEP_S / job.rig.vehicle.inertia_kg_m2
    return Order(
        name if level == 0 else f"{name}-level{level + 1}",
        {
            "kind": "pulses",
            "duration_s": DURATION_S,
            "step_nm": step_nm,
            "step_s": STEP_S,
            "slew_nm_per_s": 0.5 * job.rig.guard.rate_limit_nm_per_s,
            "most_speed_rad_s": SPARE_SPEED * expected_rad_s + SPARE_RAD_S,
            "share_m1": SHARES[name],
        },
        least_margin_rad_s=SPARE_SPEED * expected_rad_s + 2.0 * SPARE_RAD_S,
    )


def _orders(job: Job) -> list[Order]:
    return [_order(job, name, 0) for name in SHARES]


def _about(job: Job) -> str:
    largest = [f"{_order(job, name, len(LEVELS) - 1).table['step_nm']:g} Nm" for name in SHARES]
    return (
        "gives pulses of torque from standstill, both ways, with m1 alone and then with m2 alone; no speed controller "
        "takes part. Release the brakes. The vehicle moves by a hand's breadth and back. Where nothing moves, twice "
        f"and four times the torque follow, up to {' and '.join(largest)}."
    )


def _do(job: Job) -> Outcome:
    findings: list[Finding] = []
    evidence = {}
    for name in SHARES:
        answer = _ask(job, name)
        findings += _findings(name, answer)
        evidence[name] = {
            "step_nm": answer.step_nm,
            "speed": [answer.response.speed.value, answer.response.speed.ci95],
            "reading": [answer.response.reading.value, answer.response.reading.ci95],
            "course": answer.course,
        }
    return Outcome(findings, evidence)


def _ask(job: Job, name: str) -> _Answer:
    answer = _pulses(job, name, 0)
    for level in range(1, len(LEVELS)):
        if answer.seen:
            return answer
        job.say(
            f"  nothing seen to move with {answer.step_nm:g} Nm of {name}; again with {LEVELS[level]:.0%} of its limit"
        )
        answer = _pulses(job, name, level)
    return answer


def _pulses(job: Job, name: str, level: int) -> _Answer:
    order = _order(job, name, level)
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


def _findings(name: str, answer: _Answer) -> list[Finding]:
    speed, reading = answer.response.speed, answer.response.reading
    moves = "does not move" if not answer.seen else "forward" if speed.value > 0.0 else "backward"
    found = [
        Finding(
            f"{name}: torque reading over reference",
            f"{READING_SCALE[0]:g} to {READING_SCALE[1]:g}",
            reading.shown(),
            reading.is_within(*READING_SCALE),
            f"Compare rated torque (0x6076) and the sign of the current of {name} with the rig file",
            blocking=reading.value < 0.0,
        ),
        Finding(
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
    size = Finding(
        f"{name}: size of the response",
        f"{SIZE[0]:g} to {SIZE[1]:g} of what the rig file's inertia says",
        speed.shown(),
        speed.is_within(*SIZE),
        "Correct [vehicle] inertia_kg_m2, or look for a wrong scale of torque or speed, a brake, dry friction",
    )
    return [*found, size, stated(f"{name}: torque of the pulses", f"{answer.step_nm:g} Nm")]


STEP = Step("signs", "Signs and sizes", _about, _do, _orders, needs=("devices", "limits"))
