"""``case.toml`` of a real recording, schema ``hil.real-case/1``."""

from __future__ import annotations

from collections.abc import Iterator
from enum import Enum
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from hil.config.table import Positive, Table, Text
from hil.errors import FileProblem, UsageError
from hil.files import PLAIN
from hil.problems import Fault, read_toml, refuse, validate
from hil.recording.request import FormatHints

ROOM = Path(__file__).parent
CASE, MODEL, TRUTH, PROVENANCE = "case.toml", "model.toml", "truth.toml", "provenance.md"

Sha256 = Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
_PART = rf"{PLAIN}( {PLAIN})*"
Name = Annotated[str, Field(pattern=f"^{PLAIN}$")]
Relative = Annotated[str, Field(pattern=f"^{_PART}(/{_PART})*$")]
"""A path whose every part is a plain name; blanks between its words."""


class RealFileError(FileProblem):
    """A file of a real recording's folder is wrong, or the recording is not the one that it names."""


class Measure(Enum):
    """How the error of a free run is given."""

    RMS = "rms"
    """RMS of the output's error, in its unit."""

    NRMSE = "nrmse"
    """RMS of the output's error over the output's standard deviation."""

    FORCE_NRMSE = "force_nrmse"
    """RMS of the force that the error of the speed stands for, over the standard deviation of the force."""


class Judged(Enum):
    """Which samples of a held-out recording count."""

    EVERYWHERE = "everywhere"
    BLOCKS = "blocks"
    """Blocks of 0.6 s every 2 s, whose output is hidden while a recording's own course is estimated (`held_out`)."""


class Conversion(Enum):
    """What makes the recording of what is downloaded."""

    NONE = "none"
    FRICTION_DAMPER = "friction_damper"


class Origin(Table):
    """Where a recording comes from.

    Attributes
    ----------
    page
        What a person opens.
    url
        What a program can fetch; none where a person must sign in.
    member
        File inside the archive that is fetched.
    convert
        What turns it into the recording.
    """

    page: Text
    url: Text | None = None
    member: Text | None = None
    convert: Annotated[Conversion, Field(strict=False)] = Conversion.NONE


class RecordingEntry(Table):
    """One recording: its place in the data folder, its checksum, its origin; ``rows`` cuts it, first and end."""

    path: Relative
    sha256: Sha256
    origin: Origin
    rows: Annotated[list[int], Field(min_length=2, max_length=2)] | None = None


class RunEntry(Table):
    """One diagnosis: the recordings it is given, and those it never sees.

    Without any held out, the blocks count that the diagnosis keeps out of a second fit of its own.
    """

    name: Name
    fit: Annotated[list[Text], Field(min_length=1)]
    held_out: list[Text] = Field(default_factory=list)


class BlackBoxEntry(Table):
    """How the black boxes read the recordings: sampled every ``sample_time_s``, the input averaged in between."""

    sample_time_s: Positive


class CaseFile(Table):
    """Everything about a case but the truth.

    Attributes
    ----------
    concealed
        Names of the catalogue that the verdict should hold; none where nothing is missing.
    shown, withheld
        Channels the tool gets, and those that would tell what is concealed. Only what is shown is written.
    """

    schema_: Literal["hil.real-case/1"] = Field(alias="schema")
    title: Text
    concealed: list[Text]
    conceals: Text
    shown: Annotated[list[Text], Field(min_length=1)]
    withheld: list[Text]
    measure: Annotated[Measure, Field(strict=False)]
    judged: Annotated[Judged, Field(strict=False)]
    format: FormatHints = FormatHints()
    black_box: BlackBoxEntry
    recordings: Annotated[dict[Name, RecordingEntry], Field(min_length=1)]
    runs: Annotated[list[RunEntry], Field(min_length=1)]

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        refuse(self._faults())
        return self

    def _faults(self) -> Iterator[Fault]:
        both = sorted(set(self.shown) & set(self.withheld))
        if both:
            yield Fault("withheld", "channels that are not shown", both)
        for i, run in enumerate(self.runs):
            unknown = sorted({*run.fit, *run.held_out} - set(self.recordings))
            if unknown:
                yield Fault(f"runs.{i}", f"names of [recordings] ({', '.join(self.recordings)})", unknown)
            if not run.held_out and self.measure is not Measure.RMS:
                yield Fault(f"runs.{i}.held_out", "recordings, for a measure other than rms", "none")
            again = sorted(set(run.fit) & set(run.held_out))
            if again:
                yield Fault(f"runs.{i}.held_out", "recordings that are not fitted", again)
        names = [run.name for run in self.runs]
        if len(set(names)) < len(names):
            yield Fault("runs", "a name of its own for each", names)


def read_case(folder: Path) -> CaseFile:
    """Read a case's ``case.toml``.

    Raises
    ------
    RealFileError
        With one line for every fault.
    """
    path = folder / CASE
    return validate(CaseFile, read_toml(path, RealFileError), path, RealFileError)


def known_cases(room: Path = ROOM) -> dict[str, Path]:
    """Return the folder of each case by name, in alphabetical order."""
    return {path.parent.name: path.parent for path in sorted(room.glob(f"*/{CASE}"))}


def case_folders(names: list[str] | tuple[str, ...], room: Path = ROOM) -> dict[str, Path]:
    """Return the folders of the cases of these names, of all where there are none.

    Raises
    ------
    UsageError
        If there is no such case.
    """
    known = known_cases(room)
    unknown = sorted(set(names) - set(known))
    if unknown:
        raise UsageError(f"{', '.join(unknown)}: expected names of real recordings ({', '.join(known)})")
    return {name: known[name] for name in (names or known)}
