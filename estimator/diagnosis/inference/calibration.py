"""The thresholds of a verdict by likelihood, in one place; no other number decides.

Those that depend on what worlds are like are data (``thresholds.toml``), written by ``python -m hil.proof.calibrate``,
whose command the file holds.
"""

import tomllib
from importlib import resources

THRESHOLDS = tomllib.loads(resources.files(__package__).joinpath("thresholds.toml").read_text(encoding="utf-8"))

TEMPERED: float = THRESHOLDS["tempered"]
"""By which differences of scores are divided: laws of nature are written in other forms than the model's, and what
they leave takes part in every difference."""

LEAST_PROBABILITY: float = THRESHOLDS["least_probability"]
"""Probability from which an effect is named."""

MOST_PREDICTABLE: float = THRESHOLDS["most_predictable"]
"""Share of the innovations' variance that their own past may foretell."""

MOST_DEPENDENT: float = THRESHOLDS["most_dependent"]
"""Share of it that torque, speed and angle may."""

MOST_LINE: float = THRESHOLDS["most_line"]
"""Power of a line in the spectrum of the innovations over their mean power: ``exp(-x)`` is the chance of one."""

MOST_CHANGE: float = THRESHOLDS["most_change"]
"""Mean square of the innovations in a second over that of all."""

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
