"""What an operator is asked before torque: a person at a terminal, or nobody in a script."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum

from hil.errors import UsageError


class StepChoice(Enum):
    """What to do with a step."""

    GO = "go"
    SKIP = "skip"
    REPEAT = "repeat"
    QUIT = "quit"


@dataclass(frozen=True, slots=True)
class Answer:
    """What to do, and for a skip the reason."""

    what: StepChoice  # GO is a yes, and in `Talk.keep_results` that results are kept
    because: str = ""  # empty where no reason was asked for


GO = Answer(StepChoice.GO)


Ask = Callable[[str], str]
"""Shows a question and returns the line that was typed."""


@dataclass(slots=True)
class Talk:
    """Asks a person at a terminal; a script has nobody to ask, and what the command line says counts."""

    ask: Ask | None  # None in a script
    yes: bool = False  # Whether torque was agreed to on the command line
    keep: str = ""  # Why results from before a change of the rig file are kept
    _is_armed: bool = False  # Whether torque was agreed to in this call

    def may_command(self, step: str) -> Answer:
        """Ask whether a step may command the torque that was announced; the first time in a call with more words."""
        if self.yes:
            return GO
        if self.ask is None:
            raise UsageError(
                f"step {step} commands torque: expected someone at a terminal to ask, or --yes, got neither. What was "
                "done up to here is kept; read the plan by --dry-run, then call again with --yes."
            )
        if self._is_armed:
            question = "  Command this torque? [y]es, [s]kip, [q]uit: "
        else:
            question = (
                "  From here on the drives are armed. Is the vehicle where it may move, someone at the emergency stop, "
                "nobody near the shaft?\n  Go? [y]es, [s]kip, [q]uit: "
            )
        answer = _answer(
            self.ask, question, {"y": StepChoice.GO, "yes": StepChoice.GO, "s": StepChoice.SKIP, "q": StepChoice.QUIT}
        )
        self._is_armed |= answer.what is StepChoice.GO
        return answer

    def after(self, step: str, outside: int, blocked: bool) -> Answer:
        """Ask how to continue after findings outside their limits; in a script, what blocks ends it all the same."""
        if self.ask is None or not outside or (self.yes and not blocked):
            return GO
        if blocked:
            question = "  This has to be fixed first. [r]epeat, [s]kip with a reason, [q]uit: "
            words = {"r": StepChoice.REPEAT, "s": StepChoice.SKIP, "q": StepChoice.QUIT, "": StepChoice.QUIT}
            return _answer(self.ask, question, words)
        question = "  Go [o]n, [r]epeat, [q]uit: "
        return _answer(
            self.ask, question, {"o": StepChoice.GO, "": StepChoice.GO, "r": StepChoice.REPEAT, "q": StepChoice.QUIT}
        )

    def confirm(self, question: str) -> Answer:
        """Ask whether something read is right, also where torque was agreed to: nobody has seen the value before.

        A script takes it for right: it was printed, and what can't be right is refused without asking.
        """
        if self.ask is None:
            return GO
        words = {"y": StepChoice.GO, "yes": StepChoice.GO, "n": StepChoice.QUIT, "no": StepChoice.QUIT}
        return _answer(self.ask, f"  {question} [y]es, [n]o: ", words)

    def keep_results(self, changes: Sequence[str]) -> Answer:
        """Ask whether results from before the rig file was changed are kept (`GO`, with the reason) or repeated."""
        if self.keep:
            return Answer(StepChoice.GO, self.keep)
        if self.ask is None:
            return Answer(StepChoice.REPEAT)
        question = "  [r]epeat the steps done before, [k]eep their results with a reason, [q]uit: "
        answer = _answer(
            self.ask,
            question,
            {"r": StepChoice.REPEAT, "": StepChoice.REPEAT, "k": StepChoice.SKIP, "q": StepChoice.QUIT},
        )
        return Answer(StepChoice.GO, answer.because) if answer.what is StepChoice.SKIP else answer


def _answer(ask: Ask, question: str, words: dict[str, StepChoice]) -> Answer:
    """Ask until one of the words comes; `SKIP` asks for a reason until there is one."""
    expected = " or ".join(word for word in words if word)
    while (word := ask(question).strip().lower()) not in words:
        question = f"  expected {expected}, got {word or 'nothing'}\n{question.splitlines()[-1]}"
    if words[word] is not StepChoice.SKIP:
        return Answer(words[word])
    question = "  Because: "
    while not (reason := ask(question).strip()):
        question = "  A reason is needed, it is recorded. Because: "
    return Answer(StepChoice.SKIP, reason)
