"""The experiments that a rig may drive: within the limits of its ``[design]``, else of its own experiments."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from hil.config.experiment_tables import (
    EVEN_SHARE,
    AnyExperiment,
    CoastTable,
    CruiseTable,
    PulsesTable,
    RestTable,
    ReversalTable,
    TipTable,
)
from hil.config.rig_file import Rig
from hil.errors import UsageError

ExperimentDict = Mapping[str, Any]

SPEEDS = (0.02, 0.25, 0.5, 1.0)
"""Parts of the fastest speed to cruise at and coast from; the first is a creep."""

TORQUES = (0.35, 0.8)
"""Parts of the largest torque to swing and step by."""

TURNS = (0.05, 0.2, 1.0)
"""Parts of the fastest speed to turn at; at the last one each way is a long pull, which heats what heats."""

STEPS_S = (0.5, 2.0)
RAMPS_S = (1.0, 4.0)

ONE_ALONE = (EVEN_SHARE, 0.0, 1.0)
"""Parts of inverter m1: half, and each inverter by itself."""

PERIOD_S = 10.0
BAND = (0.005, 0.3)
"""Band of a multi-sine, in parts of the sampling rate."""


@dataclass(frozen=True, slots=True)
class Limits:
    """What the next experiment may ask of the vehicle, at the motor shaft."""

    torque_nm: float  # Largest base torque of both inverters together
    slew_nm_per_s: float  # fastest change of the base torque
    speed_rad_s: float  # Fastest speed, either way
    duration_s: float  # Longest recorded part
    angle_rad: float  # Farthest from where the recorded part begins

    @classmethod
    def of(cls, rig: Rig) -> Limits:
        """Take those of ``[design]``; what it does not say, as the rig file's own experiments go."""
        driven = [table for table in rig.experiments.values() if not isinstance(table, RestTable)]
        said = rig.design
        given = (said.most_torque_nm, said.most_speed_rad_s, said.most_duration_s)
        if not driven and None in given:
            raise UsageError(
                f"rig {rig.name!r}: expected an experiment, or most_torque_nm, most_speed_rad_s and most_duration_s in "
                "[design], to know what the next experiment may ask of the vehicle; got neither. Add one of them."
            )
        torque_nm, speed_rad_s, duration_s = (
            max(map(of, driven)) if value is None else value
            for value, of in zip(given, (lambda t: t.torque_nm, _speed_of, lambda t: t.duration_s), strict=True)
        )
        slew = max((table.slew_nm_per_s for table in driven), default=rig.guard.rate_limit_nm_per_s)
        return cls(torque_nm, slew, speed_rad_s, duration_s, said.most_angle_rad or math.inf)


def _speed_of(table: AnyExperiment) -> float:
    match table:
        case CruiseTable() | TipTable() | CoastTable():
            return abs(table.speed_rad_s)
        case ReversalTable():
            return table.turning_speed_rad_s
        case PulsesTable():
            return table.most_speed_rad_s
    return 0.0


def candidates(rig: Rig, limits: Limits) -> Iterator[tuple[str, ExperimentDict]]:
    """Yield what may be driven, each with a name that says what it is; not all pass the guard."""
    common = {
        "duration_s": limits.duration_s,
        "torque_nm": limits.torque_nm,
        "slew_nm_per_s": limits.slew_nm_per_s,
    }
    fastest, strongest = limits.speed_rad_s, limits.torque_nm
    for part in SPEEDS:
        speed = part * fastest
        cruise = {"kind": "cruise", "speed_rad_s": speed, **common}
        yield f"cruise at {speed:.3g} rad/s", cruise
        slow = {"prbs_clock_divider": 5 * rig.prbs.clock_divider}
        yield f"cruise at {speed:.3g} rad/s, slow PRBS", {**cruise, **slow}
        yield f"cruise at {speed:.3g} rad/s, strong fast PRBS", {**cruise, **_strong_prbs(rig, limits)}
        yield f"cruise at {speed:.3g} rad/s, multi-sine", {**cruise, "multisine": _multisine(rig)}
        yield f"coast from {speed:.3g} rad/s", {"kind": "coast", "speed_rad_s": speed, **common}
    for turn, part, share in itertools.product(TURNS, TORQUES, ONE_ALONE):
        shared = {**common, "share_m1": share, **_within(rig, limits, share)}
        swing = part * shared["torque_nm"]
        turning = {"kind": "reversal", "turning_speed_rad_s": turn * fastest, "swing_nm": swing}
        yield f"reversal by {swing:.3g} Nm at {turn * fastest:.3g} rad/s{_by(share)}", {**turning, **shared}
    for speed, part, step_s in itertools.product((0.0, 0.5 * fastest), TORQUES, STEPS_S):
        yield _steps(rig, limits, speed, part, step_s, EVEN_SHARE)
    for share in ONE_ALONE[1:]:
        yield _steps(rig, limits, 0.5 * fastest, TORQUES[-1], STEPS_S[-1], share)
    for part, ramp_s in itertools.product(TORQUES, RAMPS_S):
        ramping = {"kind": "ramp", "swing_nm": part * strongest, "ramp_s": ramp_s}
        yield f"ramps to {part * strongest:.3g} Nm in {ramp_s:g} s", {**ramping, **common, "prbs": False}


def _steps(
    rig: Rig, limits: Limits, speed_rad_s: float, part: float, step_s: float, share: float
) -> tuple[str, ExperimentDict]:
    common = {"duration_s": limits.duration_s, "share_m1": share, **_within(rig, limits, share)}
    step_nm = part * common["torque_nm"]
    stepping = {"kind": "tip", "speed_rad_s": speed_rad_s, "step_nm": step_nm, "step_s": step_s}
    return f"steps of {step_nm:.3g} Nm for {step_s:g} s at {speed_rad_s:.3g} rad/s{_by(share)}", {**stepping, **common}


def _within(rig: Rig, limits: Limits, share_m1: float) -> dict[str, float]:
    """Return torque and slew of both inverters together where one of them gives more than half."""
    share, least = max(share_m1, 1.0 - share_m1), min(table.torque_limit_nm for _, table in rig.inverters)
    room_nm = (least - rig.prbs.amplitude_nm * max(rig.prbs.part_m1, 1.0 - rig.prbs.part_m1)) / share
    slew = rig.guard.rate_limit_nm_per_s / share
    return {"torque_nm": min(limits.torque_nm, room_nm), "slew_nm_per_s": min(limits.slew_nm_per_s, slew)}


def _by(share_m1: float) -> str:
    return {0.0: ", m2 alone", 1.0: ", m1 alone"}.get(share_m1, "")


def _strong_prbs(rig: Rig, limits: Limits) -> dict[str, float]:
    """Return the largest PRBS that the guard lets through, a level each cycle, and the base torque next to it."""
    part, least_nm = max(rig.prbs.part_m1, 1.0 - rig.prbs.part_m1), min(t.torque_limit_nm for _, t in rig.inverters)
    amplitude_nm = min(rig.guard.prbs_limit_nm, 0.5 * least_nm) / part
    room_nm = min(rig.guard.sum_limit_nm - amplitude_nm, 2.0 * (least_nm - part * amplitude_nm))
    return {
        "prbs_amplitude_nm": amplitude_nm,
        "prbs_clock_divider": 1,
        "torque_nm": min(limits.torque_nm, room_nm),
    }


def _multisine(rig: Rig) -> dict[str, Any]:
    lowest, highest = (part / rig.period_s for part in BAND)
    return {
        "amplitude_nm": rig.prbs.amplitude_nm,
        "period_s": PERIOD_S,
        "lowest_hz": lowest,
        "highest_hz": highest,
        "lines": "odd_random",
    }
