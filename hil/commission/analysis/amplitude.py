"""How large a PRBS has to be, and may be.

Has to: in one run, the resonance's frequency and damping must come out with a standard deviation below `FREQUENCY_STD`
and `DAMPING_STD`. The spread of an output-error estimate is inverse to the amplitude and to the root of the length of a
run (L. Ljung, System Identification, 2nd ed., chapter 9), so that one small test predicts it; `MARGIN` is kept for
what a road adds. May: the torque guard's limits besides the base torque, and the comfort of those on board.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from hil.commission.analysis.resonance_spread import ResonanceSpread
from hil.config.rig_file import Rig

FREQUENCY_STD = 0.002
"""Relative: 0.2 % of the frequency shows a change of stiffness of 0.4 %."""

DAMPING_STD = 0.02
"""Relative: 2 % of the damping."""

MARGIN = 2.0
"""A road's unevenness and wind double what noise alone asks for; the run itself shows whether it was enough."""


@dataclass(frozen=True, slots=True)
class Cap:
    """A largest amplitude [Nm], of both inverters together, and what sets it."""

    amplitude_nm: float
    reason: str


@dataclass(frozen=True, slots=True)
class Choice:
    """The amplitude [Nm], and why it is not another."""

    amplitude_nm: float
    needed_nm: float
    cap: Cap
    reason: str


def excess(spread: ResonanceSpread) -> float:
    """Return how many times the spread is what it may be, frequency or damping, whichever is worse."""
    return max(spread.frequency_std / FREQUENCY_STD, spread.damping_std / DAMPING_STD)


def needed_nm(spread: ResonanceSpread, amplitude_nm: float) -> float:
    """Return the least amplitude that determines the resonance [Nm], given what a test with another one came to."""
    return MARGIN * amplitude_nm * excess(spread)


def torque_caps(rig: Rig) -> Iterable[Cap]:
    """Name what the torque guard leaves a PRBS besides the base torque of the rig's experiments."""
    part = rig.prbs.part_m1
    limits = {"m1": (part, rig.inverters.m1.torque_limit_nm), "m2": (1.0 - part, rig.inverters.m2.torque_limit_nm)}
    for name, (carried, limit_nm) in limits.items():
        if carried <= 0.0:
            continue
        yield Cap(rig.guard.prbs_limit_nm / carried, "guard.prbs_limit_nm")
        for key, table in rig.experiments.items():
            share = table.share_m1 if name == "m1" else 1.0 - table.share_m1
            rest_nm = (limit_nm - share * table.torque_nm) / carried
            yield Cap(rest_nm, f"inverters.{name}.torque_limit_nm besides experiments.{key}.torque_nm")
    for key, table in rig.experiments.items():
        yield Cap(rig.guard.sum_limit_nm - table.torque_nm, f"guard.sum_limit_nm besides experiments.{key}.torque_nm")


def choose(wanted_nm: float, needed: float, caps: Iterable[Cap], step_nm: float) -> Choice:
    """Choose the amplitude: the rig file's where it serves, more where the resonance asks for it, never above a cap.

    Parameters
    ----------
    wanted_nm
        Amplitude of the rig file.
    needed
        Least amplitude that determines the resonance [Nm].
    caps
        What bounds it.
    step_nm
        Resolution of the drives' torque [Nm]: the choice is a whole number of it.
    """
    cap = min(caps, key=lambda each: each.amplitude_nm)
    chosen = math.ceil(max(wanted_nm, needed) / step_nm - 1e-9) * step_nm
    reason = "as in the rig file" if needed <= wanted_nm else "raised: the resonance asks for more than the rig file's"
    if chosen > cap.amplitude_nm:
        chosen = math.floor(cap.amplitude_nm / step_nm + 1e-9) * step_nm
        reason = f"held down by {cap.reason}"
    return Choice(chosen, needed, cap, reason)
