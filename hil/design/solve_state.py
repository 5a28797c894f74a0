"""How far ``hil solve`` is: what was driven, the odds after it, what it came to; kept after every change."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from typing import Annotated, Any, Final, Literal

from pydantic import Field, TypeAdapter

from drivers.foreign_file import read_regular_text
from hil.errors import UsageError
from hil.files import is_inside, read_json
from hil.orders.order import RigSource, rig_digest
from hil.recording.checksum import text_sha256
from hil.result_folder import publish

FILE_NAME: Final = "solve.json"
SCHEMA: Final = "hil.solve/1"


class End(Enum):
    """What a call came to."""

    DECIDED = "decided"
    NOTHING_DECIDES = "nothing that may be driven would decide"
    TIME = "the vehicle's time is used up"
    DECLINED = "the operator declined"


@dataclass(frozen=True, slots=True)
class Driven:
    """One experiment that was driven: why, what was promised of it, and its recording next to the state file."""

    name: str  # of the experiment, and part of the recording's
    table: dict[str, Any]  # as it stands in a rig file
    recording: str  # name of its file
    seconds: float  # that the vehicle was needed for
    last_rad_s: float  # Speed at its end: the next one begins there
    promised_factor: float | None  # by which the odds were to change; None where it was to decide nothing
    promised_probability: float | None  # of a decision, for campaigns that count how often it came


@dataclass(frozen=True, slots=True)
class Odds:
    """What is left open after so many recordings: the probability of each, of those that are open."""

    recordings: int  # how many had been driven
    probabilities: dict[str, float]  # by name of the effect, or of several


@dataclass(slots=True)
class SolveState:
    """A search for a verdict as far as it is."""

    schema: Literal["hil.solve/1"]  # version of the file's form
    rig_sha256: str  # of what the rig file says
    model_sha256: str  # of the model file; another one is refused
    driven: list[Driven] = field(default_factory=list)  # in the order of driving
    ended_early: dict[str, str] = field(default_factory=dict)  # left their band of speed: name, and what was met
    odds: list[Odds] = field(default_factory=list)  # after each
    end: End | None = None  # None: under way, or interrupted
    because: str = ""  # what kept it from a decision: a limit, the time, the operator's reason
    provided: list[str] = field(default_factory=list)  # what a decision takes for granted: effects not tested
    verdict: str = ""  # of the last diagnosis; empty before the first
    statement: str = ""  # its words
    updated_utc: Annotated[str, Field(max_length=40)] = ""  # ISO 8601

    @property
    def vehicle_s(self) -> float:
        """Time that the vehicle was needed so far [s]."""
        return sum(each.seconds for each in self.driven)


STATE: Final = TypeAdapter(SolveState)


def fresh_state(source: RigSource, model: Path) -> SolveState:
    """Begin a state."""
    return SolveState(SCHEMA, rig_digest(source.text), text_sha256(read_regular_text(model)))


def load_state(folder: Path, source: RigSource, model: Path) -> SolveState:
    """Read the state of a folder, or begin one; refuse one of another rig or model."""
    path = folder / FILE_NAME
    fresh = fresh_state(source, model)
    if not path.exists():
        return fresh
    try:
        known = STATE.validate_python(read_json(path))
    except (OSError, ValueError) as error:
        raise UsageError(
            f"{path}: expected the state of hil solve ({SCHEMA}), got a file that can't be read as one. Move it away "
            "to begin anew in this folder, or choose another by --out."
        ) from error
    for what, was, now in (
        ("rig file", known.rig_sha256, fresh.rig_sha256),
        ("model file", known.model_sha256, fresh.model_sha256),
    ):
        if was != now:
            raise UsageError(
                f"{path}: started with another {what} than {source.path if what == 'rig file' else model}. Name that "
                "one, or begin anew in another folder by --out."
            )
    for each in known.driven:
        if not is_inside(folder, folder / each.recording):
            raise UsageError(f"{path}: a recording outside {folder}: {each.recording}")
    return known


def keep_in(folder: Path) -> Callable[[dict[str, Any]], None]:
    """Keep the state as a file of a folder."""

    def keep(document: dict[str, Any]) -> None:
        text = json.dumps(document, indent=1, allow_nan=False) + "\n"
        publish(folder, {FILE_NAME: lambda path: path.write_text(text, encoding="utf-8")})

    return keep
