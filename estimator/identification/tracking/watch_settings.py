"""How a change of the resonance is watched for."""

from __future__ import annotations

from dataclasses import dataclass

from estimator.identification.tracking.threshold import threshold_for
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
        Blocks that level and spread are learnt from: with one second each, a PRBS period of 1023 levels of 20 ms.
    baseline_blocks : int
        Blocks that the level is learnt from after an alarm: as few as make the threshold little higher.
    settling_s : float
        How long the estimate is left to itself after an alarm [s]: four memories of a forgetting of 0.995 at 20 ms.
    fewest_share : float
        A block with a smaller share of usable samples is left out.
    """

    false_alarms_per_hour: float = 0.1
    smallest_change: float = 0.01
    block_s: float = 1.0
    reference_blocks: int = 21
    baseline_blocks: int = 7
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
                Requirement("baseline_blocks", self.baseline_blocks, self.baseline_blocks >= 1, "1 or more"),
                Requirement("settling_s", self.settling_s, self.settling_s >= 0, "0 s or more"),
                Requirement("fewest_share", share, 0 < share <= 1, "a share above 0 and at most 1"),
            ),
        )

    def block_samples(self, sample_time_s: float) -> int:
        """Return the samples of a block at a sampling period [s]."""
        return max(round(self.block_s / sample_time_s), 1)

    def threshold(self, blocks: int, sample_time_s: float) -> float:
        """Return the threshold next to a level learnt from so many blocks.

        Raises
        ------
        BadSetting
            If no threshold keeps the rate of false alarms.
        """
        per_hour = HOUR_S / (self.block_samples(sample_time_s) * sample_time_s)
        return threshold_for(self.false_alarms_per_hour, per_hour, blocks, self.reference_blocks - 2)
