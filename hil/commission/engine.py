"""Go through the steps: announce, ask, do, note; skip, repeat, resume.

Whatever happens in a step, its record says so before anything else is done, and the next call begins there. Drives are
disarmed by the run itself (`hil.rig.session`), long before this hears of it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from hil.commission.announce import announcement, plan_of
from hil.commission.finding import Finding
from hil.commission.readings import json_safe
from hil.commission.record import Status, now_utc
from hil.commission.registry import STEPS
from hil.commission.rig_change import changed_keys, rig_digest
from hil.commission.step import Job, Outcome, Step
from hil.commission.talk import Answer, Talk, What
from hil.errors import RunAborted, UsageError
from hil.report.numbers import moment


@dataclass(frozen=True, slots=True)
class Asked:
    """What the command line asks of single steps: reasons to skip by name, and names to repeat."""

    skip: Mapping[str, str] = field(default_factory=dict)
    repeat: frozenset[str] = frozenset()


@dataclass(slots=True)
class Commissioning:
    """One call: from where the last one ended to the end, or to what keeps it from there.

    Attributes
    ----------
    job
        What the steps work with.
    talk
        Who is asked.
    asked
        What the command line asks of single steps.
    show
        Called with the findings of each step.
    """

    job: Job
    talk: Talk
    asked: Asked
    show: Callable[[Step, list[Finding]], None]
    _first_torque: bool = True
    _redone: set[str] = field(default_factory=set)

    def run(self) -> None:
        """Do every step that is not settled.

        Raises
        ------
        RunAborted
            If a finding blocks, or a run was ended.
        KeyboardInterrupt
            On Ctrl-C, or where the person quits.
        HilError, DriverError, EstimatorError, OSError
            Whatever a step raises; its record names it.
        """
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
            if answer.what is What.GO:
                record.rig_digest = digest
            elif record.status is not Status.SKIPPED:
                record.end(Status.PENDING, "the rig file was changed")
        decided = f"kept: {answer.because}" if answer.what is What.GO else "repeated"
        self.job.state.notes.append(
            {"at_utc": now_utc(), "what": "the rig file was changed", "changes": "; ".join(changes), "steps": decided}
        )

    def _through(self, step: Step) -> None:
        record = step.record(self.job)
        if step.name in self.asked.skip:
            self._skip(step, self.asked.skip[step.name])
            return
        if record.status.is_settled and not self._is_due(step):
            self._say_settled(step)
            return
        answer = self._do(step, keep_runs=record.status is not Status.DONE and step.name not in self.asked.repeat)
        while answer.what is What.REPEAT:
            answer = self._do(step, keep_runs=False)
        if answer.what is What.SKIP:
            self._skip(step, answer.because)

    def _is_due(self, step: Step) -> bool:
        """Whether a settled step is done again: asked for, or computed from what was done again."""
        if step.name in self.asked.repeat:
            return True
        rebuilt = self._redone.intersection(step.needs)
        skipped = step.record(self.job).status is Status.SKIPPED
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
            answer = self.talk.may_command(step.name, self._first_torque)
            _quit_if_asked(answer)
            if answer.what is What.SKIP:
                return answer
            self._first_torque = False
        outcome = self._attempt(step, keep_runs)
        return self._after(step, outcome)

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
        record.end(Status.BLOCKED if blocked else Status.DONE)
        self.job.state.save()
        self._redone.add(step.name)
        return outcome

    def _after(self, step: Step, outcome: Outcome) -> Answer:
        findings = list(outcome.findings)
        self.show(step, findings)
        for question in outcome.questions:
            self._confirm(step, question)
        stops = [finding for finding in findings if finding.stops]
        outside = sum(finding.within is False for finding in findings)
        answer = self.talk.after(step.name, outside, bool(stops))
        _quit_if_asked(answer)
        if stops and answer.what is What.GO:
            first = stops[0]
            raise RunAborted(
                f"step {step.name}: {first.what}: expected {first.expected}, got {first.measured}. {first.advice}. "
                f"Then call again; it continues from here. To continue without: --skip {step.name} --because TEXT."
            )
        return answer

    def _confirm(self, step: Step, question: str) -> None:
        self.job.say(f"  {question}")
        if self.talk.confirm(question).what is not What.GO:
            step.record(self.job).end(Status.BLOCKED, f"answered no: {question}")
            self.job.state.save()
            raise RunAborted(
                f"step {step.name}: {question} The answer was no, expected yes. Correct the register map, the PLC or "
                "the rig file; then call again; it continues from here."
            )


def _quit_if_asked(answer: Answer) -> None:
    if answer.what is What.QUIT:
        raise KeyboardInterrupt


def _in_words(error: BaseException) -> str:
    if isinstance(error, KeyboardInterrupt):
        return "interrupted by Ctrl-C or a signal"
    return f"{type(error).__name__}: {error}"
