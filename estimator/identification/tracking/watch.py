"""Change detection: has the resonance left where it was, at a stated rate of false alarms.

A reference model, the estimate once it has settled, runs free beside the driveline. If the natural frequency moves by
delta, its error is to first order ``e = w + psi delta``, with psi the gradient of the output over that frequency.
With the reference's pair of poles ``1 + l_1 q^-1 + l_2 q^-2`` and the rest of A as it is::

    psi(t) = - (dl_1/df q^-1 + dl_2/df q^-2) yhat(t) / (1 + l_1 q^-1 + l_2 q^-2)

Every second the samples come to one statistic, ``x = sum psi e / sqrt(sum psi^2)``, the score of that change with a
variance that does not depend on the excitation (the local approach: M. Basseville, I. V. Nikiforov, Detection of
Abrupt Changes, Prentice Hall 1993, chapter 8). A tracked parameter would tell the same later: the estimate takes
seconds to move, the score has it in the first block.

A change smaller than :attr:`WatchSettings.smallest_change` counts as none: what it makes of x, ``delta sqrt(sum
psi^2)``, is taken off first.

No noise model is believed: mean and spread of x are those of :attr:`WatchSettings.reference_blocks` blocks seen before,
a period of the PRBS and more, so that what the model lacks, which the PRBS repeats, is part of them. The threshold
follows from the rate of false alarms (:mod:`threshold`).

After an alarm the estimate is left to settle, tells the value after, and becomes the next reference. A slow change is
found when it has become large against the scatter of one block.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from estimator.identification.linear_model import Orders
from estimator.identification.online.recursive import Trajectory
from estimator.identification.tracking.alarm import Alarm, Level
from estimator.identification.tracking.follow import Followed
from estimator.identification.tracking.threshold import threshold_for
from estimator.identification.tracking.watch_kernel import (
    CHANGED,
    EVENT,
    OUT_BEFORE_HZ,
    OUT_BEFORE_STD_HZ,
    OUT_SINCE,
    PLACES,
    STATISTIC,
    watch_block,
)
from estimator.signals.record import FloatArray
from estimator.signals.settings import Requirement, is_positive, require

HOUR_S = 3600.0


@dataclass(frozen=True, slots=True)
class WatchSettings:
    """How a change is watched for.

    Attributes
    ----------
    false_alarms_per_hour : float
        So many an hour, at most, where the resonance does not move by more than ``smallest_change``.
    smallest_change : float
        A change up to this share of the resonance counts as none: 1 % is 2 % of the stiffness, and more than a
        heavily laden bus makes of it.
    block_s : float
        Length of a block [s]: several times the memory of the mode, so that blocks are nearly independent.
    reference_blocks : int
        Blocks that mean and spread are learnt from: with one second each, a PRBS period of 1023 levels of 20 ms.
    settling_s : float
        How long the estimate is left to itself after an alarm [s]: four memories of a forgetting of 0.995 at 20 ms.
    fewest_share : float
        A block with a smaller share of usable samples is left out.
    """

    false_alarms_per_hour: float = 0.1
    smallest_change: float = 0.01
    block_s: float = 1.0
    reference_blocks: int = 21
    settling_s: float = 16.0
    fewest_share: float = 0.8

    def __post_init__(self) -> None:
        share, blocks, smallest = self.fewest_share, self.reference_blocks, self.smallest_change
        require(
            "watch",
            (
                Requirement("smallest_change", smallest, 0 <= smallest < 1, "a share from 0 to 1"),
                Requirement("block_s", self.block_s, is_positive(self.block_s), "a length above 0 s"),
                Requirement("reference_blocks", blocks, blocks >= 3, "3 or more"),
                Requirement("settling_s", self.settling_s, self.settling_s >= 0, "0 s or more"),
                Requirement("fewest_share", share, 0 < share <= 1, "a share above 0 and at most 1"),
            ),
        )


@dataclass(frozen=True, slots=True, eq=False)
class Watched:
    """What was seen in a block: the alarms, at which kept sample each came, and the statistics, NaN between blocks."""

    alarms: tuple[Alarm, ...]
    alarm_at: tuple[int, ...]
    statistic: FloatArray


class ChangeWatch:
    """The watch with its state; memory does not grow.

    Parameters
    ----------
    orders : Orders
        Structure of the models that will come.
    sample_time_s : float
        Their sampling period [s].
    settings : WatchSettings, optional
        How to watch.

    Raises
    ------
    BadSetting
        If the rate of false alarms can't be kept by any threshold.
    """

    def __init__(self, orders: Orders, sample_time_s: float, settings: WatchSettings | None = None) -> None:
        self.settings = settings = settings or WatchSettings()
        self._period_s = sample_time_s
        block = max(round(settings.block_s / sample_time_s), 1)
        per_hour, n_reference = HOUR_S / (block * sample_time_s), settings.reference_blocks
        self.threshold = threshold_for(settings.false_alarms_per_hour, per_hour, n_reference)
        self._block_s = block * sample_time_s
        self._structure = np.array([orders.na, orders.nb, orders.nk])
        self._numbers = np.array(
            [
                sample_time_s,
                block,
                n_reference,
                settings.settling_s / sample_time_s,
                settings.fewest_share,
                self.threshold,
                settings.smallest_change,
            ]
        )
        self._live = {
            "reference": np.zeros(orders.n_parameters),
            "slope": np.zeros(4),
            "past": np.zeros((3, max(orders.na, orders.nk + orders.nb, 2))),
            "live": np.zeros(PLACES),
            "alarm": np.full(6, np.nan),
        }

    def run(self, time_s: FloatArray, u: FloatArray, y: FloatArray, estimates: Trajectory, found: Followed) -> Watched:
        """Watch a block of kept samples, each array of shape (n,); the block may have any length."""
        out, live = np.empty((len(estimates), 5)), self._live
        watch_block(
            u,
            y,
            estimates.used,
            np.ascontiguousarray(estimates.theta),
            np.ascontiguousarray(estimates.y_hat),
            np.column_stack([found.frequency_hz, found.frequency_std_hz, found.damping]),
            self._structure,
            self._numbers,
            live["reference"],
            live["slope"],
            live["past"],
            live["live"],
            out,
        )
        at = tuple(int(k) for k in np.flatnonzero(out[:, EVENT]))
        return Watched(tuple(self._alarm(float(time_s[k]), out[k], found, k) for k in at), at, out[:, STATISTIC].copy())

    def _alarm(self, time_s: float, row: FloatArray, found: Followed, k: int) -> Alarm:
        """Write the record of a change, or once more when the estimate has settled."""
        own = self._live["alarm"]
        changed = row[EVENT] == CHANGED
        if changed:
            began_s = time_s - float(row[OUT_SINCE]) * self._period_s
            own[:] = time_s, began_s, row[OUT_BEFORE_HZ], row[OUT_BEFORE_STD_HZ], row[STATISTIC], 0.0
        found_s, began_s, before_hz, before_std_hz, statistic, _ = own.tolist()
        return Alarm(
            time_s=found_s,
            changed_between_s=(began_s, found_s - self._block_s),
            quantity="resonance_hz",
            before=Level.of(before_hz, before_std_hz),
            after=Level.of(float(found.frequency_hz[k]), float(found.frequency_std_hz[k])),
            settled=not changed,
            statistic=statistic,
            threshold=self.threshold,
            false_alarms_per_hour=self.settings.false_alarms_per_hour,
        )

    def state(self) -> dict[str, FloatArray]:
        """Return the state, copied."""
        return {name: values.copy() for name, values in self._live.items()}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Go on from a state of a watch with the same settings."""
        for name, values in self._live.items():
            values[:] = state[name]
