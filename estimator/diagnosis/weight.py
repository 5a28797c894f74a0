"""Whether an effect removes enough of a mismatch to count: what beats chance may still be too little to name."""

from __future__ import annotations

from dataclasses import dataclass

from estimator.diagnosis.evidence import noise_level
from estimator.diagnosis.hypotheses import Effects
from estimator.physics.catalogue import EFFECTS
from estimator.physics.fit import FitResult
from estimator.signals.record import OutputKind

PART_OF_MISMATCH = 0.05
"""Share of the first mismatch's power that a further effect must remove, or else
``VISIBLE`` of the RMS and half of what stands."""

PART_BESIDE = 0.001
"""Share of the first mismatch's power that even a visible effect must remove: no law is nature's to better than three
per cent of what it moves, and some law elsewhere follows what is left."""

PART_FOR_DETAIL = 0.01
"""Share of what a special case removes that its generalisation must remove on top: the same friction written as
bristles or as a rounded sign differs by less."""

MOST = 0.8
"""Share of the mismatch's power, above the noise floor, that an explanation must take away to be believed."""

MOST_OF_POSITION = 0.5
"""The same where a position is read, whose error has no floor to speak of."""

VISIBLE = 1.05

NEAR_NOISE = 1.5
"""Error over the noise that an explanation may leave: another way to write the same law leaves that much."""

SEEN = 1.15
"""Error over the noise above which what is left is seen, whatever it is: the estimate of the noise errs by some per
cent."""

DETAIL = 0.005
"""Share of the mismatch's power, above the noise, that is a detail of the road or the line, or of how a law is written,
whatever it is: next to a mismatch of many times the noise it may be seen, and is not asked after."""

BELIEVED_TOGETHER = 2
"""Effects that may be a simpler law at the place of one of them in other words. More of them put together what is one
thing at one place."""


@dataclass(frozen=True, slots=True)
class Weight:
    """What counts in recordings of one noise.

    Attributes
    ----------
    floor : float
        Noise floor of the output.
    least_ratio : float
        By which an effect must lower the RMS at least: above 1 where part of the input is itself an estimate.
    """

    floor: float
    least_ratio: float = 1.0

    def level(self, result: FitResult) -> float:
        """Return the noise: of the reading, or of a fit's error if that is less."""
        return noise_level(result, self.floor)

    def may_stand(self, result: FitResult, retuned: FitResult) -> bool:
        """Tell whether a fit takes so much of the mismatch away that an explanation could rest on it."""
        return share_removed(retuned, result, self.level(result)) >= least_share(result)

    def visible(self, before: FitResult, after: FitResult) -> bool:
        """Tell whether the error falls by what can be seen in a plot, and by half of what stands over the noise."""
        standing = max(before.rms**2 - self.level(before) ** 2, 0.0)
        removed = before.rms**2 - after.rms**2
        return before.rms >= VISIBLE * after.rms and removed >= 0.5 * standing

    def counts(self, name: str, effects: Effects, after: FitResult, before: FitResult, retuned: FitResult) -> bool:
        """Tell whether an effect removes enough to count.

        At an element of its own it may be small, if it can be seen. Beside another effect of the same element it must
        be a real part of the mismatch: a law written another way leaves just such a small remainder. A profile is no
        law, its knots follow whatever is slow; what it leaves at the load is another's. But it could take up any slow
        rest itself, and so must be a real part. A wave is an echo of another wave alone, and none leaves one of a law:
        no machine's is a pure sine, but a law of twist or speed is not in step with the motor's angle.
        """
        if before.rms < self.least_ratio * after.rms:
            return False
        mismatch = self._mismatch(after, retuned)
        share = (before.rms**2 - after.rms**2) / mismatch
        if share >= PART_OF_MISMATCH:
            return True
        return share >= PART_BESIDE and not _echoes(name, effects - {name}) and self.visible(before, after)

    def leaves_room(self, current: FitResult, retuned: FitResult) -> bool:
        """Tell whether a fit leaves as much above the noise as a further effect must remove to count."""
        standing = current.rms**2 - self.level(current) ** 2
        return standing >= PART_BESIDE * self._mismatch(current, retuned)

    def _mismatch(self, after: FitResult, retuned: FitResult) -> float:
        return max(retuned.rms**2 - self.floor**2, retuned.rms**2 - after.rms**2)


def share_removed(before: FitResult, after: FitResult, level: float) -> float:
    """Return the share of the mismatch's power, above the noise, that a fit takes away; 1 where none stands."""
    standing = before.rms**2 - min(level, after.rms) ** 2
    return (before.rms**2 - after.rms**2) / standing if standing > 0.0 else 1.0


def leaves_a_detail(before: FitResult, after: FitResult, floor: float) -> bool:
    """Tell whether what a fit leaves above the noise is next to nothing of the mismatch."""
    return after.rms**2 - min(floor, after.rms) ** 2 <= DETAIL * (before.rms**2 - min(floor, before.rms) ** 2)


def reads_speed(result: FitResult) -> bool:
    """Tell whether a fit is of speeds alone."""
    return all(record.kind is OutputKind.SPEED for record in result.problem.records)


def least_share(result: FitResult) -> float:
    """Return the share of the mismatch's power that an explanation must take away."""
    return MOST if reads_speed(result) else MOST_OF_POSITION


def _echoes(name: str, others: Effects) -> bool:
    """Tell whether a small effect could be what other laws leave because nature's are written another way."""
    entry = EFFECTS[name]
    if entry.phases:
        return any(EFFECTS[other].phases for other in others)
    laws = [EFFECTS[other] for other in others if not (EFFECTS[other].profile or EFFECTS[other].phases)]
    return entry.profile or entry.element in {law.element for law in laws}


def earns_detail(special: FitResult, general: FitResult, before: FitResult) -> bool:
    """Tell whether the general law removes clearly more of the mismatch than its special case."""
    removed = special.rms**2 - general.rms**2
    return removed >= PART_FOR_DETAIL * (before.rms**2 - special.rms**2)
