"""The thresholds of a verdict by likelihood, in one place; no other number decides.

Set by hand while about twenty simulated cases were looked at, not calibrated: docs/diagnosis.md says so and
what a calibration has to do. Until then this engine is not in charge of ``hil diagnose``.
"""

TEMPERED = 4.0
"""By which differences of scores are divided: laws of nature are written in other forms than the model's, and what
they leave takes part in every difference."""

LEAST_PROBABILITY = 0.9
"""Probability from which an effect is named."""

LEAST_SHARE = 0.01
"""Share of the re-tuned model's squared free-run error below which an effect is a trace (CONTRACT)."""

ALIKE_WITHIN = 10.0
"""Difference in score within which another effect in an effect's place is as good: very strong evidence in the scale
of Kass and Raftery, J. Am. Stat. Assoc. 90, 1995."""

ALIKE_SHARE = 0.03
"""The same over what the effect itself explains: nature's laws are written in other forms, and none is known to better
than some per cent of what it does."""

MOST_PREDICTABLE = 0.03
"""Share of the innovations' variance that their own past may foretell."""

MOST_DEPENDENT = 0.015
"""Share of it that torque, speed and angle may."""

MOST_LINE = 25.0
"""Power of a line in the spectrum of the innovations over their mean power: ``exp(-x)`` is the chance of one."""

MOST_CHANGE = 3.0
"""Mean square of the innovations in a second over that of all."""

CLEARLY_BELOW = 0.5
"""RMS of the augmented model's error, over the spread of the signal, up to which anything is explained."""
