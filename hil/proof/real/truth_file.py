"""``truth.toml`` of a real recording, schema ``hil.real-truth/1``: what is known of the machine, and by whom."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from hil.config.table import Positive, Table, Text
from hil.problems import read_toml, validate
from hil.proof.real.case_file import TRUTH, RealFileError


class KnownValue(Table):
    """A quantity that somebody else has measured or identified.

    Attributes
    ----------
    found
        Where ``diagnosis.json`` has it: ``parameters.J_M``, ``effects.backlash.gap_rad``, ``load_torque``.
    within
        Relative difference up to which the two agree.
    """

    what: Text
    found: Annotated[str, Field(pattern=r"^(parameters\.\w+|effects\.\w+\.\w+|load_torque)$")]
    value: float
    unit: Text
    within: Positive


class Channel(Table):
    """A withheld or shown channel times ``scale``, in SI units."""

    column: Text
    scale: float = 1.0


class KnownGrade(Table):
    """A road's grade, from an accelerometer along the car: it reads the rise of the speed and ``g sin(grade)``.

    Attributes
    ----------
    low_pass_hz
        What both courses are seen through.
    correlation
        Least median over the runs.
    """

    effect: Text
    acceleration: Channel
    speed: Channel
    low_pass_hz: Positive
    correlation: Annotated[float, Field(gt=0, lt=1)]


class Goal(Table):
    """An error that the augmented model should not exceed, in the case's measure.

    Attributes
    ----------
    on
        ``fit`` or ``held_out``; of several recordings the median counts.
    recordings
        Those that count; all where none are named.
    """

    what: Text
    on: Literal["fit", "held_out"]
    at_most: Positive
    recordings: list[Text] = Field(default_factory=list)


class TruthFile(Table):
    """What is known of a machine next to its recordings."""

    schema_: Literal["hil.real-truth/1"] = Field(alias="schema")
    source: Text
    values: list[KnownValue] = Field(default_factory=list)
    grade: KnownGrade | None = None
    goals: list[Goal] = Field(default_factory=list)


def read_truth(folder: Path) -> TruthFile:
    """Read a case's ``truth.toml``.

    Raises
    ------
    RealFileError
        With one line for every fault.
    """
    path = folder / TRUTH
    return validate(TruthFile, read_toml(path, RealFileError), path, RealFileError)
