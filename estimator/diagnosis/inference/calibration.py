"""The thresholds of a verdict by likelihood, in one place; no other number decides.

Those that depend on what worlds are like are data (``thresholds.toml``), written by
``python -m tests.campaigns.calibrate``, whose command the file holds; it marks those that are a choice. Those in this
file are choices, each with its reason.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path

THRESHOLDS_FILE = Path(__file__).parent / "thresholds.toml"

THRESHOLDS = tomllib.loads(THRESHOLDS_FILE.read_text(encoding="utf-8"))

TEMPERED: float = THRESHOLDS["tempered"]
"""By which differences of scores are divided: laws of nature are written in other forms than the model's, and what
they leave takes part in every difference."""

LEAST_PROBABILITY: float = THRESHOLDS["least_probability"]
"""Probability from which an effect is named."""


@dataclass(frozen=True, slots=True)
class Limit:
    """The most that a test may find in noise; ``is_share`` where it finds a share of the innovations' variance."""

    most: float
    is_share: bool = False


TEST_LIMITS = {
    "most_predictable": Limit(THRESHOLDS["most_predictable"], is_share=True),
    "most_dependent": Limit(THRESHOLDS["most_dependent"], is_share=True),
    "most_line": Limit(THRESHOLDS["most_line"]),
    "most_change": Limit(THRESHOLDS["most_change"]),
}
"""What their own past may predict of the innovations, and what torque, speed and angle may, beyond chance; the power
of a line in their spectrum over their mean power; their mean square in a second, in standard deviations from that of
all."""

LEAST_SHARE = 0.01
"""Share of the re-tuned model's squared free-run error below which an effect is a trace (CONTRACT)."""

ALIKE_WITHIN = 10.0
"""Difference in score within which another effect in an effect's place is as good: very strong evidence in the scale
of Kass and Raftery, J. Am. Stat. Assoc. 90, 1995."""

ALIKE_SHARE = 0.03
"""The same over what the effect itself explains: nature's laws are written in other forms, and none is known to better
than some per cent of what it does."""

CLEARLY_BELOW = 0.5
"""RMS of the augmented model's error, over the spread of the signal, up to which anything is explained."""
