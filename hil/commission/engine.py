"""The steps of a commissioning in their order: announce, ask, do, note; skip, repeat, resume."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

from hil.commission.responses import json_safe
from hil.commission.state import Note, Status, StepFinding
from hil.commission.step import Outcome, Step, StepContext
from hil.commission.steps.checks import DEVICES, LIMITS
from hil.commission.steps.experiments import EXPERIMENTS, IDENTIFICATION
from hil.commission.steps.models import DIAGNOSIS, VALIDATION
from hil.commission.steps.next_experiments import SOLVE
from hil.commission.steps.noise_friction import FRICTION, NOISE
from hil.commission.steps.prbs import PRBS
from hil.commission.steps.signs_scales import SCALES, SIGNS
from hil.errors import RunAborted, UsageError
from hil.orders.operator import Answer, StepChoice, Talk
from hil.orders.order import changed_keys, rig_digest
from hil.orders.runner import Prediction, now_utc
from hil.report.numbers import moment

STEPS = (
    DEVICES,
    LIMITS,
    NOISE,
    SIGNS,
    SCALES,
    FRICTION,
    PRBS,
    EXPERIMENTS,
    IDENTIFICATION,
    VALIDATION,
    DIAGNOSIS,
    SOLVE,
)

NAMES = tuple(step.name for step in STEPS)


CONNECT_S = 3.0
"""Opening, configuring, arming and disarming, per run [s]; see docs/benchmarks.md."""

QUESTION_S = 30.0
"""A person reads and answers, per step with torque [s]."""

MOST_VEHICLE_S = 40 * 60
"""A commissioning should not take the vehicle for longer [s]."""


@dataclass(frozen=True, slots=True)
class PlannedRun:
    """One run of a plan: what is predicted of it [s, Nm, rad/s]."""

    name: str  # of the order
    seconds: float  # length of the whole run
    torque_m1_nm: tuple[float, float]  # smallest and largest over the whole run, PRBS included
    torque_m2_nm: tuple[float, float]  # the same of inverter m2
    speed_rad_s: tuple[float, float]  # smallest and largest over the whole run

    @classmethod
    def of(cls, name: str, prediction: Prediction) -> PlannedRun:
        """Return a prediction as a plan has it."""
        m1, m2, speed = prediction.torque_m1_nm, prediction.torque_m2_nm, prediction.speed_rad_s
        return cls(name, prediction.seconds, (m1.low, m1.high), (m2.low, m2.high), (speed.low, speed.high))


def plan_of(job: StepContext, step: Step) -> list[PlannedRun]:
    """Predict the runs of a step; none where it commands no torque."""
    runs, speed_rad_s = [], job.rolling_rad_s()
    for order in step.orders(job):
        prediction = job.predict(order, speed_rad_s)
        speed_rad_s = prediction.last_rad_s
        runs.append(PlannedRun.of(order.name, prediction))
    return runs


def vehicle_seconds(runs: Sequence[PlannedRun]) -> float:
    """Return how long the vehicle is needed for the runs of one step [s]."""
    return sum(run.seconds + CONNECT_S for run in runs) + (QUESTION_S if runs else 0.0)


def announcement(job: StepContext, step: Step, runs: Sequence[PlannedRun]) -> list[str]:
    """Return the lines that announce a step, and what is predicted of its runs."""
    number = [each.name for each in STEPS].index(step.name) + 1
    lines = ["", f"{number}/{len(STEPS)} {step.title} ({step.name})", f"  It {step.about(job)}"]
    if not runs:
        return lines
    width = max(len(run.name) for run in runs)
    lines.append("  predicted, through the torque guard:")
    lines += [
        f"    {run.name:{width}}  {run.seconds:5.1f} s   m1 {_range(run.torque_m1_nm)} Nm   "
        f"m2 {_range(run.torque_m2_nm)} Nm   speed {_range(run.speed_rad_s, 1)} rad/s"
        for run in runs
    ]
    lines.append(f"  {sum(run.seconds for run in runs):.0f} s of driving")
    return lines


def _range(values: tuple[float, float], digits: int = 0) -> str:
    low, high = (round(value, digits) + 0.0 for value in values)
    return f"{low:{6 + digits}.{digits}f} to {high:{4 + digits}.{digits}f}"


def plan_document(job: StepContext) -> dict[str, Any]:
    """Return the whole plan (schema ``hil.commission_plan/1``), as far as it can be known before."""
    steps: list[dict[str, Any]] = []
    total_s = 0.0
    for step in STEPS:
        runs = plan_of(job, step)
        total_s += vehicle_seconds(runs)
        steps.append(
            {
                "name": step.name,
                "title": step.title,
                "about": f"It {step.about(job)}",
                "status": step.record(job).status.value,
                "runs": [asdict(run) for run in runs],
                "vehicle_s": round(vehicle_seconds(runs), 1),
            }
        )
    return {
        "schema": "hil.commission_plan/1",
        "rig": job.rig.name,
        "steps": steps,
        "vehicle_s": round(total_s, 1),
        "most_vehicle_s": MOST_VEHICLE_S,
    }


@dataclass(frozen=True, slots=True)
class StepRequests:
    """What the command line asks of single steps: reasons to skip by name, and names to repeat."""

    skip: Mapping[str, str] = field(default_factory=dict)  # reason by name of the step
    repeat: frozenset[str] = frozenset()  # names of steps, also of those that are settled


@dataclass(slots=True)
class Commissioning:
    """One call: from where the last one ended to the end, or to what keeps it from there."""

    job: StepContext  # What the steps work with
    talk: Talk  # Who is asked
    asked: StepRequests  # What the command line asks of single steps
    show: Callable[[Step, list[StepFinding]], None]  # Called with the findings of each step
    _redone: set[str] = field(default_factory=set)  # names of the steps attempted in this call

    def run(self) -> None:
        """Do every step that is not settled."""
        self.job.may_command = self._may_command
        self._look_for_changes()
        for step in STEPS:
            self._through(step)

    def _look_for_changes(self) -> None:
        state, text = self.job.state, self.job.source.text
        digest = rig_digest(text)
        changes = changed_keys(state.rig_text, text)
        state.rig_text, state.rig_path, state.rig_name = text, str(self.job.source.path), self.job.rig.name
        outdated = [name for name, record in state.steps.items() if record.rig_digest and record.rig_digest != digest]
        if outdated:
            self.job.say("the rig file was changed since steps were done: " + ("; ".join(changes) or "see its history"))
            self.job.say(f"  done with another one: {', '.join(outdated)}")
            answer = self.talk.keep_results(changes)
            _quit_if_asked(answer)
            self._settle_outdated(outdated, answer, digest, changes)
        state.save()

    def _settle_outdated(self, outdated: list[str], answer: Answer, digest: str, changes: list[str]) -> None:
        for name in outdated:
            record = self.job.state.steps[name]
            if answer.what is StepChoice.GO:
                record.rig_digest = digest
            elif record.status is not Status.SKIPPED:
                record.end(Status.PENDING, "the rig file was changed")
        decided = f"kept: {answer.because}" if answer.what is StepChoice.GO else "repeated"
        self.job.state.notes.append(Note(now_utc(), "the rig file was changed", "; ".join(changes), decided))

    def _through(self, step: Step) -> None:
        record = step.record(self.job)
        if step.name in self.asked.skip:
            self._skip(step, self.asked.skip[step.name])
            return
        if record.status.is_settled and not self._is_due(step):
            self._say_settled(step)
            return
        is_anew = record.status.is_settled or record.status is Status.PENDING or step.name in self.asked.repeat
        answer = self._do(step, keep_runs=not is_anew)
        while answer.what is StepChoice.REPEAT:
            answer = self._do(step, keep_runs=False)
        if answer.what is StepChoice.SKIP:
            self._skip(step, answer.because)

    def _is_due(self, step: Step) -> bool:
        """Whether a settled step is done again: asked for, or computed from what was done again."""
        if step.name in self.asked.repeat:
            return True
        rebuilt = self._redone.intersection(step.needs)
        record = step.record(self.job)
        skipped = record.status is Status.SKIPPED and not record.evidence  # by a person, and not by itself
        return bool(rebuilt) and not step.orders(self.job) and not skipped

    def _say_settled(self, step: Step) -> None:
        record = step.record(self.job)
        because = f", because: {record.because}" if record.status is Status.SKIPPED else ""
        self.job.say(f"{step.title}: {record.status.value} {moment(record.ended_utc)}{because}")
        if rebuilt := sorted(self._redone.intersection(step.needs)):
            self.job.say(f"  it was driven before {', '.join(rebuilt)} was repeated; again by --repeat {step.name}")

    def _skip(self, step: Step, because: str) -> None:
        record = step.record(self.job)
        if record.status is Status.SKIPPED and record.because == because:
            self._say_settled(step)
            return
        record.begin(rig_digest(self.job.source.text), keep_runs=False)
        record.end(Status.SKIPPED, because)
        self.job.state.save()
        self.job.say(f"{step.title}: skipped, because: {because}")

    def _do(self, step: Step, keep_runs: bool) -> Answer:
        """Do a step once, and return how to continue."""
        plan = plan_of(self.job, step)
        for line in announcement(self.job, step, plan):
            self.job.say(line)
        if plan:
            answer = self._may_command(step.name)
            if answer.what is StepChoice.SKIP:
                return answer
        outcome = self._attempt(step, keep_runs)
        return self._after(step, outcome)

    def _may_command(self, what: str) -> Answer:
        answer = self.talk.may_command(what)
        _quit_if_asked(answer)
        return answer

    def _attempt(self, step: Step, keep_runs: bool) -> Outcome:
        record = step.record(self.job)
        record.begin(rig_digest(self.job.source.text), keep_runs)
        self.job.state.save()
        try:
            outcome = step.do(self.job)
        except BaseException as error:
            record.end(Status.INTERRUPTED, _in_words(error))
            try:
                self.job.state.save()
            except UsageError as trouble:  # what ended the step is what has to be reported first
                if str(trouble) != str(error):
                    error.add_note(str(trouble))
            raise
        record.findings, record.evidence = list(outcome.findings), json_safe(outcome.evidence)
        blocked = any(finding.stops for finding in record.findings)
        done = Status.SKIPPED if outcome.needless else Status.DONE
        record.end(Status.BLOCKED if blocked else done, outcome.needless)
        self.job.state.save()
        self._redone.add(step.name)
        return outcome

    def _after(self, step: Step, outcome: Outcome) -> Answer:
        findings = list(outcome.findings)
        if outcome.needless:
            self.job.say(f"{step.title}: skipped, because: {outcome.needless}")
        else:
            self.show(step, findings)
        for question in outcome.questions:
            self._confirm(step, question)
        stops = [finding for finding in findings if finding.stops]
        outside = sum(finding.within is False for finding in findings)
        answer = self.talk.after(step.name, outside, bool(stops))
        _quit_if_asked(answer)
        if stops and answer.what is StepChoice.GO:
            first = stops[0]
            raise RunAborted(
                f"step {step.name}: {first.what}: expected {first.expected}, got {first.measured}. {first.advice}. "
                f"Then call again; it continues from here. To continue without: --skip {step.name} --because TEXT."
            )
        return answer

    def _confirm(self, step: Step, question: str) -> None:
        self.job.say(f"  {question}")
        if self.talk.confirm(question).what is not StepChoice.GO:
            step.record(self.job).end(Status.BLOCKED, f"answered no: {question}")
            self.job.state.save()
            raise RunAborted(
                f"step {step.name}: {question} The answer was no, expected yes. Correct the register map, the PLC or "
                "the rig file; then call again; it continues from here."
            )


def _quit_if_asked(answer: Answer) -> None:
    if answer.what is StepChoice.QUIT:
        raise KeyboardInterrupt


def _in_words(error: BaseException) -> str:
    if isinstance(error, KeyboardInterrupt):
        return "interrupted by Ctrl-C or a signal"
    return f"{type(error).__name__}: {error}"
