"""Diagnose, design, ask, drive, diagnose again: until it is decided, or nothing that may be driven would decide it."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from typing import Annotated, Any, Final, Literal

from pydantic import Field, TypeAdapter

from estimator.design import Open, left_open
from estimator.diagnosis.result import Diagnosis
from estimator.signals.record import Record
from hil.commission.order import Order, RigSource, as_table, rig_digest
from hil.commission.runner import Runner
from hil.commission.state import now_utc
from hil.commission.talk import Talk, What
from hil.config.model_file import ModelFile
from hil.config.rig_file import Rig
from hil.design.design import Aim, Design, designed, is_needed
from hil.design.report import design_lines, question_lines
from hil.errors import UsageError
from hil.files import is_inside, read_json
from hil.provenance import provenance
from hil.recording import read_records
from hil.recording.checksum import text_sha256
from hil.report.diagnosis_files import publish_diagnosis
from hil.report.outputs import publish

FILE_NAME: Final = "solve.json"
SCHEMA: Final = "hil.solve/1"
STEP = "solve"
"""Name of the step that drives: the first part of its recordings' names."""


LEAST_MARGIN_RAD_S = 2.0
"""How far a speed may leave its predicted range, at least [rad/s]: what is missing in the model is not predicted."""


class End(Enum):
    """What a call came to."""

    DECIDED = "decided"
    NOTHING_DECIDES = "nothing that may be driven would decide"
    TIME = "the vehicle's time is used up"
    DECLINED = "the operator declined"


@dataclass(frozen=True, slots=True)
class Driven:
    """One experiment that was driven: why, what was promised of it, and its recording next to the state file."""

    name: str
    table: dict[str, Any]
    recording: str
    seconds: float
    last_rad_s: float  # Speed at its end: the next one begins there
    promised_factor: float | None
    promised_probability: float | None


@dataclass(slots=True)
class State:
    """A search for a verdict as far as it is."""

    schema: Literal["hil.solve/1"]
    rig_sha256: str
    model_sha256: str
    driven: list[Driven] = field(default_factory=list)
    end: End | None = None
    verdict: str = ""
    statement: str = ""
    updated_utc: Annotated[str, Field(max_length=40)] = ""

    @property
    def vehicle_s(self) -> float:
        """Time that the vehicle was needed so far [s]."""
        return sum(each.seconds for each in self.driven)


_STATE: Final = TypeAdapter(State)


def load_state(folder: Path, source: RigSource, model: Path) -> State:
    """Read the state of a folder, or begin one; refuse one of another rig or model."""
    path = folder / FILE_NAME
    fresh = State(SCHEMA, rig_digest(source.text), text_sha256(model.read_text(encoding="utf-8")))
    if not path.exists():
        return fresh
    try:
        known = _STATE.validate_python(read_json(path))
    except ValueError as error:
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


@dataclass(slots=True)
class Solving:
    """One call: from where the last one ended to a verdict, or to what keeps it from there."""

    folder: Path
    source: RigSource
    file: ModelFile
    model: Path
    runner: Runner
    talk: Talk
    state: State
    given: Sequence[Path]  # recordings of the rig from before
    effort: str
    most_vehicle_s: float  # time that the vehicle may be needed for in all [s]
    say: Callable[[str], None]
    progress: Callable[[str, float], None]

    def run(self) -> End:
        """Continue until it ends; what ends it is in the state."""
        if self.state.end is End.DECIDED:
            self.say(f"decided before: {self.state.statement}")
            return End.DECIDED
        self.state.end = None
        if not self.given and not self.state.driven and (end := self._drive(*_first(self.source.rig()))):
            return self._ended(end)
        while True:
            known, _ = self._diagnosed()
            found = self._next(known)
            end = found if isinstance(found, End) else self._drive(*found)
            if end is not None:
                return self._ended(end)

    def _next(self, known: Open) -> tuple[str, dict[str, Any], Design | None] | End:
        """Return what to drive next, by name, table and design, or how it ends.

        That nothing is missing is decided after all of the rig file: a short run may miss what acts for a while.
        """
        is_open = not known.is_decided or bool(known.untested)
        if is_open and is_needed(known, Aim.DECIDE):
            design = designed(self.source, known, Aim.DECIDE, self.progress)
            for line in design_lines(known, design):
                self.say(line)
            if design.is_worth_driving:
                return design.planned.name, dict(design.planned.table), design
            if len(known.candidates) > 1:
                return End.NOTHING_DECIDES
        if not self.given and not known.candidates[0].effects:
            done = {each.name for each in self.state.driven}
            for name, table in self.source.rig().experiments.items():
                if name not in done:
                    self.say(f"nothing is missing so far: {name} of the rig file is still to be driven")
                    return name, as_table(table), None
        return End.DECIDED

    @property
    def _left_s(self) -> float:
        return max(self.most_vehicle_s - self.state.vehicle_s, 0.0)

    @property
    def _paths(self) -> list[Path]:
        return [*self.given, *(self.folder / each.recording for each in self.state.driven)]

    def _diagnosed(self) -> tuple[Open, Diagnosis]:
        """Diagnose all recordings, and publish the verdict: it stands whatever comes after."""
        records: tuple[Record, ...] = read_records(self._paths, self.file.signals, self.file.on_bench)
        known, diagnosis = left_open(records, self.file.model, self.effort, self.progress)
        made = provenance([self.model], self._paths)
        publish_diagnosis(self.folder, diagnosis, self.file, records, self._paths, made)
        self.state.verdict, self.state.statement = diagnosis.verdict.value, diagnosis.statement
        self._save()
        self.say(f"after {len(self._paths)} recordings: {diagnosis.statement}")
        for line in question_lines(known):
            self.say(line)
        return known, diagnosis

    def _drive(self, name: str, table: Any, design: Design | None = None) -> End | None:
        """Drive an experiment if there is time and the operator agrees; what was driven whole is in the state."""
        order = Order(f"next_{len(self.state.driven) + 1}", dict(table), least_margin_rad_s=LEAST_MARGIN_RAD_S)
        model, rolling_rad_s = self.file.model, self.state.driven[-1].last_rad_s if self.state.driven else 0.0
        prediction = self.runner.predict(order, model, rolling_rad_s)
        if self.state.vehicle_s + prediction.seconds > self.most_vehicle_s:
            self.say(f"{name}: it needs {prediction.seconds:.0f} s of {self._left_s:.0f} s that the vehicle is left")
            return End.TIME
        m1, m2, speed = prediction.torque_m1_nm, prediction.torque_m2_nm, prediction.speed_rad_s
        self.say(
            f"{name}: {prediction.seconds:.0f} s, m1 {m1.low:.0f} to {m1.high:.0f} Nm, m2 {m2.low:.0f} to "
            f"{m2.high:.0f} Nm, speed {speed.low:.1f} to {speed.high:.1f} rad/s, through the torque guard"
        )
        if self.talk.may_command(name, not self.state.driven).what is not What.GO:
            return End.DECLINED
        run = self.runner.run(STEP, order, model, rolling_rad_s, lambda _: None)
        decides = None if design is None else design.decides
        self.state.driven.append(
            Driven(
                name,
                json.loads(json.dumps(dict(table))),
                str(run.recording),
                run.seconds,
                run.last_rad_s,
                None if decides is None else decides.factor,
                None if decides is None else decides.right,
            )
        )
        self._save()
        return None

    def _ended(self, end: End) -> End:
        self.state.end = end
        self._save()
        self.say(f"ended: {end.value}. {self.state.statement}")
        return end

    def _save(self) -> None:
        self.state.updated_utc = now_utc()
        text = json.dumps(_STATE.dump_python(self.state, mode="json"), indent=1, allow_nan=False) + "\n"
        publish(self.folder, {FILE_NAME: lambda path: path.write_text(text, encoding="utf-8")})

    def document(self) -> dict[str, Any]:
        """Return the result as JSON: the state."""
        found: dict[str, Any] = _STATE.dump_python(self.state, mode="json")
        return found


def _first(rig: Rig) -> tuple[str, dict[str, Any]]:
    """Return the rig file's first experiment: what it drives where nothing was recorded."""
    if not rig.experiments:
        raise UsageError(
            f"rig {rig.name!r}: expected an experiment to begin with, or recordings, got neither. Add [experiments.…] "
            "to the rig file; see examples/rig.toml."
        )
    name, table = next(iter(rig.experiments.items()))
    return name, as_table(table)
