"""Files of a real recording's case: what is concealed, what may be seen of the recordings, and what is known.

A case is a folder of ``recordings``; adding one is adding a folder. The recordings are no part of the project.

==================  ==================================================================================================
``case.toml``       what is concealed, which channels the tool may see, which recordings are fitted and which held out
``model.toml``      the nominal model, with the concealed physics left out
``truth.toml``      what is known of the machine; read when the tool has answered
``provenance.md``   source, licence, citation
==================  ==================================================================================================
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from enum import Enum
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from drivers.foreign_file import open_regular
from hil.config.table import FileTable, Positive, Text
from hil.errors import FileProblem, UsageError
from hil.files import PLAIN
from hil.problems import Fault, read_toml, refuse, validate
from hil.recording.formats import read_table
from hil.recording.publish import write_table
from hil.recording.request import FormatHints, Request
from hil.recording.table import Table as Columns

ROOM = Path(__file__).with_name("recordings")
CASE, MODEL, TRUTH, PROVENANCE = "case.toml", "model.toml", "truth.toml", "provenance.md"

Sha256 = Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
_PART = rf"{PLAIN}( {PLAIN})*"
Name = Annotated[str, Field(pattern=f"^{PLAIN}$")]
Relative = Annotated[str, Field(pattern=f"^{_PART}(/{_PART})*$")]
"""A path whose every part is a plain name; blanks between its words."""


class RealFileError(FileProblem):
    """A file of a real recording's folder is wrong, or the recording is not the one that it names."""


class Conversion(Enum):
    """What makes the recording of what is downloaded."""

    NONE = "none"
    FRICTION_DAMPER = "friction_damper"


class Origin(FileTable):
    """Where a recording comes from: the page that a person opens; the file that a program can fetch, if there is one.

    ``member`` is a file inside the archive that is fetched, ``convert`` what turns it into the recording.
    """

    page: Text  # its address
    url: Text | None = None  # None: a person has to fetch it
    member: Text | None = None
    convert: Annotated[Conversion, Field(strict=False)] = Conversion.NONE


class RecordingEntry(FileTable):
    """One recording: its place in the data folder, its checksum, its origin; ``rows`` cuts it, first and end."""

    path: Relative  # in the data folder
    sha256: Sha256  # of the file
    origin: Origin  # where it comes from
    rows: Annotated[list[int], Field(min_length=2, max_length=2)] | None = None


class RunEntry(FileTable):
    """One diagnosis: the recordings that are fitted, and those that are held out."""

    name: Name  # of its own in the case
    fit: Annotated[list[Text], Field(min_length=1)]  # names of [recordings]
    held_out: list[Text] = Field(default_factory=list)  # names of [recordings]; the verdict is tried on them


class CaseFile(FileTable):
    """Everything about a case but the truth."""

    schema_: Literal["hil.real-case/1"] = Field(alias="schema")
    title: Text  # for the page
    concealed: list[Text]  # names of the catalogue that the verdict should hold
    conceals: Text  # the same in words
    shown: Annotated[list[Text], Field(min_length=1)]  # channels that the tool gets
    withheld: list[Text]  # channels that would tell what is concealed
    format: FormatHints = FormatHints()  # how the recordings are written
    recordings: Annotated[dict[Name, RecordingEntry], Field(min_length=1)]  # by name
    runs: Annotated[list[RunEntry], Field(min_length=1)]  # each is judged by itself

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
            again = sorted(set(run.fit) & set(run.held_out))
            if again:
                yield Fault(f"runs.{i}.held_out", "recordings that are not fitted", again)
        names = [run.name for run in self.runs]
        if len(set(names)) < len(names):
            yield Fault("runs", "a name of its own for each", names)


class KnownValue(FileTable):
    """A quantity that somebody else has measured or identified."""

    what: Text  # in words
    # place of the same in diagnosis.json
    found: Annotated[str, Field(pattern=r"^(parameters\.\w+|effects\.\w+\.\w+|load_torque)$")]
    value: float  # that was measured or identified by others
    unit: Text  # of diagnosis.json, too
    within: Positive  # relative difference up to which the two agree


class TruthFile(FileTable):
    """What is known of a machine next to its recordings."""

    schema_: Literal["hil.real-truth/1"] = Field(alias="schema")
    source: Text  # who says so
    values: list[KnownValue] = Field(default_factory=list)  # may be none


def read_case(folder: Path) -> CaseFile:
    """Read a case's ``case.toml``."""
    path = folder / CASE
    return validate(CaseFile, read_toml(path, RealFileError), path, RealFileError)


def read_truth(folder: Path) -> TruthFile:
    """Read a case's ``truth.toml``."""
    path = folder / TRUTH
    return validate(TruthFile, read_toml(path, RealFileError), path, RealFileError)


def known_cases(room: Path = ROOM) -> dict[str, Path]:
    """Return the folder of each case by name, in alphabetical order."""
    return {path.parent.name: path.parent for path in sorted(room.glob(f"*/{CASE}"))}


def case_folders(names: list[str] | tuple[str, ...], room: Path = ROOM) -> dict[str, Path]:
    """Return the folders of the cases of these names, of all where there are none."""
    known = known_cases(room)
    unknown = sorted(set(names) - set(known))
    if unknown:
        raise UsageError(f"{', '.join(unknown)}: expected names of real recordings ({', '.join(known)})")
    return {name: known[name] for name in (names or known)}


def sha256_of(path: Path) -> str:
    """Return the checksum of a file, hexadecimal."""
    with open_regular(path) as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def require_recording(data: Path, entry: RecordingEntry) -> Path:
    """Return the path of a recording that is there and is the one that was meant."""
    path = data / entry.path
    if not path.is_file():
        raise RealFileError(path, f"expected a recording, got nothing. It is published at {entry.origin.page}")
    got = sha256_of(path)
    if got != entry.sha256:
        raise RealFileError(
            path, f"expected the SHA-256 {entry.sha256}, got {got}. Fetch it again, or name the new one"
        )
    return path


def write_shown(case: CaseFile, name: str, data: Path, place: Path) -> Path:
    """Write what is shown of a recording as ``place/NAME.csv``: cut to its rows, numbers to the last bit."""
    entry = case.recordings[name]
    table = read_table(require_recording(data, entry), Request(case.format))
    missing = [column for column in case.shown if column not in table.columns]
    if missing:
        raise RealFileError(table.path, f"expected the channels {missing}, got {', '.join(table.columns)}")
    rows = slice(None) if entry.rows is None else slice(*entry.rows)
    path = place / f"{name}.csv"
    write_table(Columns(path, {column: table.columns[column][rows] for column in case.shown}), path, replace=True)
    return path
