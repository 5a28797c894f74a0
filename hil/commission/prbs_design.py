"""The amplitude of the PRBS: what the resonance needs, and what torque, speed and comfort allow."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from estimator.identification.modes.modes import Mode, resonance, uncertain_modes
from estimator.physics.model import DrivelineModel, Structure
from estimator.signals.record import FloatArray
from hil.config.rig_file import Rig

if TYPE_CHECKING:
    from estimator.identification.offline.fits import LinearFit

FREQUENCY_STD = 0.002
"""Relative: 0.2 % of the frequency shows a change of stiffness of 0.4 %."""

DAMPING_STD = 0.02
"""Relative: 2 % of the damping."""

MARGIN = 2.0
"""A road's unevenness and wind double what noise alone asks for; the run itself shows whether it was enough."""

COMFORT_LIMIT_M_S2 = 0.315
"""Upper end of "not uncomfortable" [m/s2 RMS]: ISO 2631-1:1997, C.2.3."""

FELT_HZ = (0.5, 20.0)
"""Band of vibration looked at [Hz]: ISO 2631-1 begins at 0.5 Hz; above 20 Hz W_d is below 0.1, and noise begins."""

DEFAULT_TRAVEL_M_PER_RAD = 0.48 / 5.6
"""Way per radian of the motor shaft [m]: wheel radius 0.48 m over ratio 5.6, the bus assumed in DESIGN."""


@dataclass(frozen=True, slots=True)
class ResonanceSpread:
    """The resonance and the standard deviations of its frequency and damping, relative to each."""

    mode: Mode  # the one in the band that was looked at
    frequency_std: float  # over the frequency, 0.002 is 0.2 %
    damping_std: float  # over the magnitude of the damping

    def scaled(self, factor: float) -> ResonanceSpread:
        """Return the same with standard deviations so many times as large."""
        return ResonanceSpread(self.mode, factor * self.frequency_std, factor * self.damping_std)


def resonance_spread(fit: LinearFit, band_hz: tuple[float, float]) -> ResonanceSpread | None:
    """Return the resonance of a fit and how well it is known; None without one in the band."""
    mode = resonance(fit.model, band_hz)
    if mode is None:
        return None
    every = uncertain_modes(fit.model, fit.covariance)
    known = next(each for each in every if each.frequency_hz.value == mode.frequency_hz)
    return ResonanceSpread(mode, known.frequency_hz.std / mode.frequency_hz, known.damping.std / abs(mode.damping))


@dataclass(frozen=True, slots=True)
class Cap:
    """A largest amplitude [Nm], of both inverters together, and what sets it."""

    amplitude_nm: float  # of several caps the lowest counts
    reason: str  # key of the rig file, or what else limits it, in words


@dataclass(frozen=True, slots=True)
class Choice:
    """The amplitude [Nm], and why it is not another."""

    amplitude_nm: float  # of both inverters together, a multiple of the step
    needed_nm: float  # what the resonance needs, before it is rounded up
    cap: Cap  # the lowest
    reason: str  # in words, for the finding


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
    """Choose the amplitude: the rig file's where it serves, more where the resonance asks for it, never above a cap."""
    cap = min(caps, key=lambda each: each.amplitude_nm)
    chosen = math.ceil(max(wanted_nm, needed) / step_nm - 1e-9) * step_nm
    reason = "as in the rig file" if needed <= wanted_nm else "raised: the resonance asks for more than the rig file's"
    if chosen > cap.amplitude_nm:
        chosen = math.floor(cap.amplitude_nm / step_nm + 1e-9) * step_nm
        reason = f"held down by {cap.reason}"
    return Choice(chosen, needed, cap, reason)


def vibration_m_s2(
    torque_nm: FloatArray,
    speed_rad_s: FloatArray,
    model: DrivelineModel,
    period_s: float,
    travel_m_per_rad: float,
) -> float:
    """Return the RMS of the vehicle's acceleration in the band that is felt [m/s2]."""
    from scipy.signal import butter, sosfiltfilt  # half a second, and the bus comes first

    values = model.values()
    acceleration = np.gradient(speed_rad_s, period_s)
    if model.structure is not Structure.ONE_MASS:
        load = sum(values[name] for name in ("J_2", "J_L") if name in values)
        acceleration = (torque_nm - values["J_M"] * acceleration) / load
    high_hz = min(FELT_HZ[1], 0.45 / period_s)
    felt = sosfiltfilt(butter(2, (FELT_HZ[0], high_hz), "bandpass", fs=1.0 / period_s, output="sos"), acceleration)
    return float(travel_m_per_rad * np.sqrt(np.mean(felt**2)))
