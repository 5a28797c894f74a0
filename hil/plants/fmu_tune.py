"""Parameters of an FMU that are re-tuned: each by the parameter of its line that it acts as, which is measured."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from estimator.diagnosis.result import Retuned
from estimator.physics.fit import fit
from estimator.physics.model import DrivelineModel
from estimator.physics.problem import make_problem
from estimator.physics.unknowns import Shared
from estimator.signals.record import Record
from hil.errors import ModelFileError, UsageError
from hil.problems import read_toml

LEFT = 0.1
"""Share of the change it makes that is left, at most, where a parameter of the line is moved in its place."""


def tolerances(given: Sequence[str]) -> dict[str, float]:
    """Return what ``--tune`` gives: ``k=20%``, or a TOML file of such names and shares."""
    found: dict[str, float] = {}
    for text in given:
        if text.endswith(".toml"):
            entries = {str(name): str(value) for name, value in read_toml(Path(text), ModelFileError).items()}
        else:
            entries = dict([text.partition("=")[::2]])
        for name, share in entries.items():
            try:
                value = float(share.rstrip("%")) / (100.0 if share.endswith("%") else 1.0)
            except ValueError:
                value = math.nan
            if not 0.0 < value < 1.0 or name in found:
                raise UsageError(f"--tune {text}: expected NAME=20% or NAME=0.2, each name once, got {name}={share}")
            found[name] = value
    return found


@dataclass(frozen=True, slots=True)
class Tuned:
    """A parameter of an FMU that acts as one of the line: that one goes with its ``exponent``-th power."""

    name: str  # in the FMU
    start: float  # its value in the FMU
    unit: str  # as the FMU has it; empty where it has none
    exponent: float
    tolerance: float  # to which it is trusted

    @property
    def of_line(self) -> float:
        """Tolerance of the line's parameter."""
        return min(abs(math.pow(1.0 + self.tolerance, self.exponent) - 1.0), 0.95)

    def value_of(self, factor: float) -> float:
        """Return its value where the line's parameter is multiplied."""
        return self.start * float(max(factor, 0.0) ** (1.0 / self.exponent))

    def found_as(self, line: Retuned) -> Retuned:
        """Return what was found of the line's parameter as that of the FMU's."""
        value, low, high = (self.value_of(each / line.nominal) for each in (line.value, *line.ci95))
        return Retuned(self.start, value, (min(low, high), max(low, high)), self.unit)


def acting_as(
    name: str, line: DrivelineModel, changed: Sequence[Record], error: float, factor: float
) -> tuple[str, float]:
    """Return which parameter of a line does what a parameter of the FMU does that was multiplied, and its exponent.

    ``changed`` are the FMU's answers with it; ``error`` is what the line is off without.
    """
    nothing = fit(make_problem(line, changed, ())).rms
    if nothing <= 2.0 * error:
        raise UsageError(f"--tune {name}: expected a parameter that the output shows, got one that changes nothing")
    fits = {
        each: fit(make_problem(line, changed, (Shared("", each, parameter.value, 0.2, 5.0, 1.0),)))
        for each, parameter in line.parameters.items()
        if parameter.value > 0.0
    }
    best = min(fits, key=lambda each: fits[each].rms)
    left = math.sqrt(max(fits[best].rms ** 2 - error**2, 0.0) / (nothing**2 - error**2))
    if left > LEFT:
        raise UsageError(
            f"--tune {name}: expected a parameter of the FMU that acts as one of {', '.join(fits)} of a driveline; the "
            f"nearest is {best}, which leaves {100 * left:.0f} % of what it changes. Take it out of --tune."
        )
    return best, math.log(fits[best].values_of("")[best] / line.parameters[best].value) / math.log(factor)


def in_names_of_fmu(parameters: Mapping[str, Retuned], tuned: Mapping[str, Tuned]) -> dict[str, Retuned]:
    """Return the parameters that were found, those of the FMU by its names."""
    return {
        tuned[name].name if name in tuned else name: tuned[name].found_as(each) if name in tuned else each
        for name, each in parameters.items()
    }
