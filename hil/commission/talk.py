"""Who answers the questions of a commissioning: a person at a terminal, or nobody in a script."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Protocol

from hil.errors import UsageError


class What(Enum):
    """What to do with a step."""

    GO = "go"
    SKIP = "skip"
    REPEAT = "repeat"
    QUIT = "quit"


@dataclass(frozen=True, slots=True)
class Answer:
    """What to do, and for a skip the reason."""

    what: What
    because: str = ""


GO = Answer(What.GO)


class Talk(Protocol):
    """Asks, and is answered."""

    def may_command(self, step: str, first: bool) -> Answer:
        """Ask whether a step may command the torque that was just announced; ``first`` is the first of this call."""
        ...

    def after(self, step: str, outside: int, blocked: bool) -> Answer:
        """Ask how to continue after a step with findings outside their limits."""
        ...

    def confirm(self, question: str) -> Answer:
        """Ask whether something read is right: `GO`, or `QUIT`."""
        ...

    def keep_results(self, changes: Sequence[str]) -> Answer:
        """Ask whether results from before the rig file was changed are kept (`GO`, with the reason) or repeated."""
        ...


@dataclass(frozen=True, slots=True)
class Script:
    """Nobody to ask.

    Attributes
    ----------
    yes
        Whether torque may be commanded.
    keep
        Why results from before a change of the rig file are kept; empty to repeat those steps.
    """

    yes: bool
    keep: str = ""

    def may_command(self, step: str, first: bool) -> Answer:
        """Answer by ``--yes``.

        Raises
        ------
        UsageError
            Without it.
        """
        if not self.yes:
            raise UsageError(
                f"step {step} commands torque: expected someone at a terminal to ask, or --yes, got neither. What was "
                "done up to here is kept; read the plan by --dry-run, then call again with --yes."
            )
        return GO

    def after(self, step: str, outside: int, blocked: bool) -> Answer:
        """Continue; what blocks ends the commissioning all the same."""
        return GO

    def confirm(self, question: str) -> Answer:
        """Take it for right: it was printed, and what can't be right is refused without asking."""
        return GO

    def keep_results(self, changes: Sequence[str]) -> Answer:
        """Keep them where a reason was given."""
        return Answer(What.GO, self.keep) if self.keep else Answer(What.REPEAT)


Ask = Callable[[str], str]
"""Shows a question and returns the line that was typed."""


@dataclass(slots=True)
class Person:
    """Someone at a terminal.

    Attributes
    ----------
    ask
        Shows a question and returns the answer.
    yes
        Whether torque was agreed to on the command line.
    keep
        As in `Script`.
    """

    ask: Ask
    yes: bool = False
    keep: str = ""

    def may_command(self, step: str, first: bool) -> Answer:
        """Ask before every step with torque, with more words before the first."""
        if self.yes:
            return GO
        if first:
            question = (
                "  From here on the drives are armed. Is the vehicle where it may move, someone at the emergency stop, "
                "nobody near the shaft?\n  Go? [y]es, [s]kip, [q]uit: "
            )
        else:
            question = "  Command this torque? [y]es, [s]kip, [q]uit: "
        return self._answer(question, {"y": What.GO, "yes": What.GO, "s": What.SKIP, "q": What.QUIT})

    def after(self, step: str, outside: int, blocked: bool) -> Answer:
        """Ask where something is outside its limits."""
        if not outside or (self.yes and not blocked):
            return GO
        if blocked:
            question = "  This has to be fixed first. [r]epeat, [s]kip with a reason, [q]uit: "
            return self._answer(question, {"r": What.REPEAT, "s": What.SKIP, "q": What.QUIT, "": What.QUIT})
        question = "  Go [o]n, [r]epeat, [q]uit: "
        return self._answer(question, {"o": What.GO, "": What.GO, "r": What.REPEAT, "q": What.QUIT})

    def confirm(self, question: str) -> Answer:
        """Ask, also where torque was agreed to on the command line: nobody has seen the value before."""
        return self._answer(
            f"  {question} [y]es, [n]o: ", {"y": What.GO, "yes": What.GO, "n": What.QUIT, "no": What.QUIT}
        )

    def keep_results(self, changes: Sequence[str]) -> Answer:
        """Ask, unless a reason to keep them was given."""
        if self.keep:
            return Answer(What.GO, self.keep)
        question = "  [r]epeat the steps done before, [k]eep their results with a reason, [q]uit: "
        answer = self._answer(question, {"r": What.REPEAT, "": What.REPEAT, "k": What.SKIP, "q": What.QUIT})
        return Answer(What.GO, answer.because) if answer.what is What.SKIP else answer

    def _answer(self, question: str, words: dict[str, What]) -> Answer:
        """Ask until one of the words comes; `SKIP` asks for a reason until there is one."""
        expected = " or ".join(word for word in words if word)
        while (word := self.ask(question).strip().lower()) not in words:
            question = f"  expected {expected}, got {word or 'nothing'}\n{question.splitlines()[-1]}"
        if words[word] is not What.SKIP:
            return Answer(words[word])
        question = "  Because: "
        while not (reason := self.ask(question).strip()):
            question = "  A reason is needed, it is recorded. Because: "
        return Answer(What.SKIP, reason)
