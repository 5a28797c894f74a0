"""Active damping in a run: its torque each cycle, what switches it off, and what the closed loop turned out to be.

Its torque goes with the PRBS, in the torque offset, through the one guard and under the PRBS limit. It acts in the
measured part alone, on the speed of the cycle before. Where that was not read, or is in doubt, its torque is zero, and
it starts anew with the next good one. It goes off for the rest of the run in the cycle after the shaft has swung more
than it would without it (`hil.rig.swing_watch`), the on-line estimate has left the region of the design by more than it
can be wrong, or its own torque has stood at the limit for a period of the resonance. The run then continues with its
reference alone, or ends, as ``[guard] without_damper`` of the rig file has it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from estimator.errors import EstimatorError
from estimator.identification.linear_model import Orders
from estimator.identification.modes.modes import UncertainMode, uncertain_modes
from estimator.identification.offline.fits import fit_output_error
from estimator.identification.online.recursive import Status
from estimator.identification.settings import Settings
from estimator.signals.record import Record
from hil.config.damper_file import DamperFile, DesignedFor
from hil.errors import RunAborted
from hil.rig.experiments.base import Phase
from hil.rig.live import LiveEstimate
from hil.rig.swing_watch import SwingWatch
from hil.sample import Sample

DEVIATIONS = 3.0
BIAS = 0.02
"""The recursive estimate may be off by so much of the frequency, besides its own deviation."""


@dataclass(slots=True)
class Damping:
    """The feedback of one run; an `Observer`, which takes a sample after the estimate it is supervised by.

    ``off`` says why it is off, and since when; it is empty while it acts.
    """

    file: DamperFile  # filter, period, region and line of the design
    rig: DesignedFor  # the file's own `rig`, which is there; `limit_nm` of it bounds the torque
    live: LiveEstimate  # of the same run; its resonance is compared with the design's region
    off: str = ""
    ends_run: bool = False  # True where [guard] without_damper is "end"; `hil.rig.plan` sets it
    _watch: SwingWatch = field(init=False)  # made from the file
    _given_nm: float = 0.0  # torque of the present cycle [Nm]
    _last: Sample | None = None  # latest sample, of any phase; None before the first
    # both states of the filter [Nm]; None: it starts anew with the next speed
    _states: tuple[float, float] | None = None
    _at_limit: int = 0  # cycles in succession with the torque at its limit
    # of the measured part: time [s], PRBS [Nm], speed [rad/s], `Sample.counts`
    _rows: list[tuple[float, float, float, bool]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._watch = SwingWatch(self.file)

    def torque_nm(self, cycle: int) -> float:
        """Return the torque of a cycle [Nm]; zero while it is off, or without a good speed of the cycle before."""
        self._given_nm = self._torque_nm(cycle)
        return self._given_nm

    def _torque_nm(self, cycle: int) -> float:
        last = self._last
        fresh = last is not None and last.counts and last.cycle == cycle - 1
        if last is None or self.off or not fresh or not abs(last.speed_rad_s) < 1e30:  # nor of NaN
            self._states = None
            return 0.0
        return self._filtered(last.speed_rad_s)

    def _filtered(self, speed_rad_s: float) -> float:
        (b0, b1, b2), (_, a1, a2), limit_nm = self.file.filter.b, self.file.filter.a, self.rig.limit_nm
        if self._states is None:  # as after a long time at this speed
            self._states = ((b1 + b2) * speed_rad_s, b2 * speed_rad_s)
        first, second = self._states
        wanted = b0 * speed_rad_s + first
        out = min(max(wanted, -limit_nm), limit_nm)
        self._states = (b1 * speed_rad_s - a1 * out + second, b2 * speed_rad_s - a2 * out)
        self._at_limit = self._at_limit + 1 if out != wanted else 0
        return -out

    def __call__(self, sample: Sample, phase: Phase) -> None:
        """Take the next sample, and switch off where that is due."""
        self._last = sample
        if phase is not Phase.MEASURE or self.off:
            return
        self._rows.append((sample.time_s, sample.prbs_nm, sample.speed_rad_s, sample.counts))
        open_nm = sample.torque_ref_m1_nm + sample.torque_ref_m2_nm - self._given_nm
        swings = self._watch.take(open_nm, sample.speed_rad_s) if sample.counts else ""
        if reason := swings or self._reason():
            self.off = f"at {sample.time_s:.2f} s: {reason}"
            if self.ends_run:
                raise RunAborted(f"damper: switched off {self.off}. [guard] without_damper = 'end' ends the run.")

    def _reason(self) -> str:
        (low, high), latest = self.file.region_hz, self.live.latest
        if latest is not None and latest.status is Status.ESTIMATED and latest.resonance is not None:
            hz, std_hz = latest.resonance.frequency_hz, latest.frequency_std_hz
            spread_hz = BIAS * hz + (DEVIATIONS * std_hz if math.isfinite(std_hz) else 0.0)
            if not low - spread_hz <= hz <= high + spread_hz:
                return f"the resonance is at {hz:.2f} Hz, the damper was designed for {low:.2f} to {high:.2f} Hz"
        if self._at_limit > most_at_limit(self.file):
            return f"its torque stood at the limit of {self.rig.limit_nm:.0f} Nm for a period of the resonance"
        return ""

    def measured(self) -> UncertainMode | None:
        """Return the least damped mode from PRBS to speed with the loop closed; None where the data carry none."""
        if len(self._rows) < 2:
            return None
        time_s, prbs_nm, speed, okay = (np.array(column) for column in zip(*self._rows, strict=True))
        okay = okay.astype(np.bool_) & np.isfinite(speed)
        record = Record("closed loop", self.file.period_s, time_s, prbs_nm[:, None], speed, okay)
        poles = 5 + (self.file.lag_s > 0.0) + self.file.timing.held  # of line, filter, lag, and torques that wait
        try:
            fit = fit_output_error(Settings().offline(record), Orders(poles, poles - 1, 1))
            modes = uncertain_modes(fit.model, fit.covariance)
        except EstimatorError:
            return None
        near_hz = self.file.nominal[0].frequency_hz
        near = [each for each in modes if near_hz / 3.0 < each.frequency_hz.value < 3.0 * near_hz]
        return min(near, key=lambda each: each.damping.value, default=None)

    def document(self) -> dict[str, Any]:
        """Return what came of it, as JSON."""
        found, expected = self.measured(), self.file.nominal[1]
        modes = {} if found is None else {"frequency_hz": found.frequency_hz, "damping": found.damping}
        return {
            "off": self.off or None,
            "expected": {"frequency_hz": expected.frequency_hz, "damping": expected.damping},
            "measured": {name: {"value": one.value, "ci95": list(map(float, one.ci95))} for name, one in modes.items()}
            or None,
        }


def most_at_limit(file: DamperFile) -> int:
    """Return the cycles of a period of the resonance: longer its torque may not stand at the limit."""
    return int(1.0 / (file.region_hz[0] * file.period_s))


def damping_lines(document: dict[str, Any]) -> list[str]:
    """Say what came of the damper."""
    expected, measured = document["expected"], document["measured"]
    lines = [f"damper switched off {document['off']}"] if document["off"] else []
    said = f"expected {expected['frequency_hz']:.2f} Hz, damping {expected['damping']:.3f}"
    if measured is None:
        return [*lines, f"loop closed: {said}; the recording carries no mode to compare with"]
    f, d = measured["frequency_hz"], measured["damping"]
    low, high = d["ci95"]
    off = 100.0 * (d["value"] / expected["damping"] - 1.0)
    found = f"{f['value']:.2f} Hz, damping {d['value']:.3f} ({low:.3f} to {high:.3f})"
    return [*lines, f"loop closed: {found}; {said} ({off:+.1f} %)"]
