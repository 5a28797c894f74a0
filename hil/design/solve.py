"""Diagnose, design, ask, drive, diagnose again: until it is decided, or nothing that may be driven would decide it."""

from __future__ import annotations

import json
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from estimator.design.left_open import left_open
from estimator.design.open import Open, name_of
from estimator.design.paper import LEAST_PROBABILITY, as_model
from estimator.diagnosis.result import Diagnosis, Verdict
from estimator.physics.catalogue import title_of
from estimator.physics.driveline import Load
from estimator.physics.model import DrivelineModel
from estimator.physics.tables import PLACES
from estimator.signals.record import Record
from hil.config.model_file import ModelFile
from hil.design.design import Aim, Design, NothingAllowed, designed, is_needed
from hil.design.report import as_rival, conditions, design_lines, in_words, obstacle, question_lines
from hil.design.solve_state import STATE, Driven, End, Odds, SolveState
from hil.errors import UsageError
from hil.orders.operator import Answer, StepChoice
from hil.orders.order import Order, RigSource, as_table
from hil.orders.runner import Runner, RunRecord, SpeedBandLeft, now_utc
from hil.provenance import provenance
from hil.recording import read_records
from hil.report.diagnosis_files import publish_diagnosis

STEP = "solve"
"""Name of the step that drives: the first part of its recordings' names."""


OTHER_FORM = "what is there has another form than either"

LEAST_MARGIN_RAD_S = 2.0
"""How far a speed may leave its predicted range, at least [rad/s]: what is missing in the model is not predicted."""


@dataclass(slots=True)
class Solving:
    """One call: from where the last one ended to a verdict, or to what keeps it from there."""

    folder: Path  # where the verdict is published; recordings are in the runner's
    source: RigSource  # the user's rig file
    file: ModelFile  # the nominal model
    model: Path  # its file, for its digest and for what a result names
    runner: Runner  # drives an order and keeps its recording
    may_command: Callable[[str], Answer]  # asks the operator
    state: SolveState  # what was driven so far; changed in place
    given: Sequence[Path]  # recordings of the rig from before
    effort: str  # of each diagnosis, as --effort has it
    most_vehicle_s: float  # time that the vehicle may be needed for in all [s]
    rolling_rad_s: float  # speed of the vehicle before the next run
    keep: Callable[[dict[str, Any]], None]  # keeps the state
    say: Callable[[str], None]  # shows a line to the operator
    progress: Callable[[str, float], None]  # stage, and the share of it that is done
    note: Callable[[RunRecord], None] = lambda _: None  # called after each run, also of one that was ended early
    done: Collection[str] = ()  # experiments of the rig file that the given recordings are of

    def run(self) -> End:
        """Continue until it ends; what ends it is in the state."""
        if self.state.end is End.DECIDED:
            self.say(f"decided before: {self.state.statement}")
            return End.DECIDED
        self.state.end, self.state.because = None, ""
        if not self.given and not self.state.driven and (end := self._drive(*self._first())):
            return self._ended(end)
        while True:
            known, diagnosis = self._diagnosed()
            found = self._next(known)
            if found is End.DECIDED:
                self.state.because, self.state.provided = "", [*conditions(known)]
            elif found is End.NOTHING_DECIDES:
                self.state.because = self.state.because or _undecidable(known, diagnosis)
            end = found if isinstance(found, End) else self._drive(*found, known)
            if end is not None:
                return self._ended(end)

    def _next(self, known: Open) -> tuple[str, dict[str, Any], Design | None] | End:
        """Return what to drive next, by name, table and design, or how it ends.

        It is decided by the verdict, where the odds agree with it. That nothing is missing is decided after all of the
        rig file, and after what shows effects that were not tested: a short run may miss what acts for a while.
        """
        self.state.because = ""
        if is_needed(known, Aim.DECIDE):
            design = self._designed(known)
            decides = design is not None and design.decides is not None and not design.shows
            if decides and self._is_left_open_against_the_promise():
                names = " and ".join(in_words(each.name) for each in known.candidates)
                self.state.because = f"two experiments that should have decided between {names} did not: {OTHER_FORM}"
            elif design is not None and design.is_worth_driving:
                return design.planned.name, dict(design.planned.table), design
        if not known.named:
            left = {name: table for name, table in self.source.rig().experiments.items() if name not in self._driven}
            for name, table in left.items():
                if name not in self.state.ended_early:
                    self.say(f"nothing has a name so far: {name} of the rig file is still to be driven")
                    return name, as_table(table), None
            if left:
                self.state.because = f"{', '.join(left)} of the rig file ended early"
                return End.NOTHING_DECIDES
        return End.DECIDED if known.is_decided else End.NOTHING_DECIDES

    def _is_left_open_against_the_promise(self) -> bool:
        """Tell whether the last two experiments should have decided between what was open, and left it as it was.

        Each explanation takes a part of what a law of another form leaves, in every experiment anew.
        """
        last, driven = self.state.odds[-3:], self.state.driven[-2:]
        promised = [each.promised_probability or 0.0 for each in driven]
        same = len({frozenset(each.probabilities) for each in last}) == 1
        return len(last) == 3 and same and len(promised) == 2 and min(promised) >= LEAST_PROBABILITY

    @property
    def _driven(self) -> set[str]:
        """Experiments of which there is a whole recording."""
        return {*self.done, *(each.name for each in self.state.driven)}

    def _first(self) -> tuple[str, dict[str, Any]]:
        """Return the first of the rig file that did not end early: what is driven where nothing was recorded."""
        rig = self.source.rig()
        if not rig.experiments:
            raise UsageError(
                f"rig {rig.name!r}: expected an experiment to begin with, or recordings, got neither. Add "
                "[experiments.…] to the rig file; see examples/rig.toml."
            )
        own = list(rig.experiments.items())
        name, table = next((each for each in own if each[0] not in self.state.ended_early), own[0])
        return name, as_table(table)

    def _designed(self, known: Open) -> Design | None:
        """Design the next experiment and say it; None where the rig's limits allow none."""
        try:
            left_out = dict.fromkeys(self._driven, "it was driven before") | self.state.ended_early
            design = designed(self.source, known, Aim.DECIDE, self.progress, left_out)
        except NothingAllowed as error:
            self.state.because = str(error)
            return None
        for line in design_lines(known, design):
            self.say(line)
        self.state.because = "" if design.is_worth_driving else obstacle(design)
        return design

    @property
    def _paths(self) -> list[Path]:
        return [*self.given, *(self.runner.folder / each.recording for each in self.state.driven)]

    def _diagnosed(self) -> tuple[Open, Diagnosis]:
        """Diagnose all recordings, and publish the verdict: it stands whatever comes after."""
        records: tuple[Record, ...] = read_records(self._paths, self.file.signals, self.file.on_bench)
        known, diagnosis = left_open(records, self.file.model, self.effort, self.progress)
        made = provenance([self.model], self._paths)
        publish_diagnosis(self.folder, diagnosis, self.file, records, self._paths, made)
        self.state.verdict, self.state.statement = diagnosis.verdict.value, diagnosis.statement
        now = Odds(len(records), {each.name: each.probability for each in known.candidates})
        self.state.odds = [each for each in self.state.odds if each.recordings < now.recordings] + [now]
        self._save()
        self.say(f"after {len(self._paths)} recordings: {diagnosis.statement}")
        for line in question_lines(known):
            self.say(line)
        return known, diagnosis

    def _drive(self, name: str, table: Any, design: Design | None = None, known: Open | None = None) -> End | None:
        """Drive an experiment if there is time and the operator agrees; what was driven whole is in the state."""
        order = Order(f"next_{len(self.state.driven) + 1}", dict(table), least_margin_rad_s=LEAST_MARGIN_RAD_S)
        lines = [*_lines(known, design), self.file.model]
        prediction = self.runner.predictions(order, lines, self.rolling_rad_s)[0]
        if self.state.vehicle_s + prediction.seconds > self.most_vehicle_s:
            left_s = max(self.most_vehicle_s - self.state.vehicle_s, 0.0)
            self.state.because = f"{name} needs the vehicle for {prediction.seconds:.0f} s, left are {left_s:.0f} s"
            return End.TIME
        m1, m2, speed = prediction.torque_m1_nm, prediction.torque_m2_nm, prediction.speed_rad_s
        self.say(
            f"{name}: {prediction.seconds:.0f} s, m1 {m1.low:.0f} to {m1.high:.0f} Nm, m2 {m2.low:.0f} to "
            f"{m2.high:.0f} Nm, speed {speed.low:.1f} to {speed.high:.1f} rad/s, through the torque guard"
        )
        answer = self.may_command(name)
        if answer.what is not StepChoice.GO:
            self.state.because = answer.because
            return End.DECLINED
        try:
            run = self.runner.run(STEP, order, lines, self.rolling_rad_s, self.note)
        except BaseException as error:
            self._ended_early(name, error)
            raise
        self.rolling_rad_s = run.last_rad_s
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

    def _ended_early(self, name: str, error: BaseException) -> None:
        """Keep what is known, and say it; what left its band would leave it again."""
        if isinstance(error, SpeedBandLeft):
            self.state.ended_early[name] = str(error)
        self.state.because = f"{name} was ended early: {error or 'interrupted'}"
        self._save()
        left_out = f", and leaves {name} out" if name in self.state.ended_early else ""
        self.say(f"{name} was ended early. {self.state.statement or 'Nothing was recorded whole so far.'}")
        self.say(f"the next call continues from what was recorded whole ({len(self._paths)}){left_out}")

    def _ended(self, end: End) -> End:
        self.state.end = end
        self._save()
        because = f" ({self.state.because})" if self.state.because else ""
        self.say(f"ended: {end.value}{because}. {self.state.statement}")
        for condition in self.state.provided if end is End.DECIDED else ():
            self.say(f"decided {condition}")
        return end

    def _save(self) -> None:
        self.state.updated_utc = now_utc()
        self.keep(self.document())

    def document(self) -> dict[str, Any]:
        """Return the result as JSON: the state."""
        found: dict[str, Any] = STATE.dump_python(self.state, mode="json")
        return found


def _undecidable(known: Open, diagnosis: Diagnosis) -> str:
    """Say why a verdict is no decision though nothing is left to drive for it."""
    if diagnosis.verdict in (Verdict.UNEXPLAINED, Verdict.PARTLY_EXPLAINED):
        law = "" if known.unnamed is None else f": a torque over {PLACES[known.unnamed.place].over} is in the model"
        return f"what is left has no name in the catalogue{law}"
    if known.against:
        rivals = "; ".join(f"{as_rival(each)} ({each.probability:.2f})" for each in known.against)
        return f"the verdict names {in_words(name_of(known.named or frozenset()))}, and the odds leave {rivals}"
    twins = {name: known.twins[name] for name in sorted(known.candidates[0].effects) if name in known.twins}
    return "; ".join(
        f"{' or '.join(map(title_of, (name, *others)))}: another output decides it" for name, others in twins.items()
    )


def _lines(known: Open | None, design: Design | None) -> list[DrivelineModel]:
    """Return the lines that the vehicle may be, the most probable first, each as loaded as it was and with no load."""
    if known is None:
        return []
    supposed = () if design is None else (known.supposed[name] for name in design.shows if name in known.supposed)
    loaded = [as_model(each, known.line) for each in (*known.candidates, *(each.supposed for each in supposed))]
    if known.unnamed is not None:
        loaded = [as_model(*known.foremost), *loaded]
    return [*loaded, *(replace(each, load=Load.OWN) for each in loaded)]
