"""What the keys do, and the dialogs: choosing an experiment, a mark, help."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.screen import ModalScreen
from textual.widgets import Input, OptionList, Static
from textual.widgets.option_list import Option

from hil.monitor.layout import PAGES
from hil.monitor.messages import Choice
from hil.monitor.panel import printable

DRIVING_KEYS = "e start  SPACE stop  m mark  r reset  "

VIEWING_KEYS = "+/- time  ? help  q quit"

SCROLL_KEYS = "↑↓ scroll  ? help  q quit"

HELP = """\
e         choose an experiment of the rig file and start it; asks first
SPACE, x  stop at once: zero torque, drives disarmed
m         mark this moment; the mark goes into the recording
r         reset the drives' faults, configure them again; at rest only
1 to 5    overview, model, resonance, bus, log; TAB the next
+ -       signals over a shorter or a longer time
arrows    back and forth in the log; Page Up and Page Down too
q         quit; a run ends at zero torque first; Ctrl-C does the same

STALE     older than it should be; NO NEWS: nothing comes any more
silent    did not answer in time
FLAGGED   samples of a late cycle, or of one in which someone was
          silent: gaps in the plots, and the estimate does without
UNSURE    the ± (two standard deviations) is more than half the value
twist     estimated from torque and speed with a two-mass model; a
          backlash's free play is not in it
                                                       ? or Esc: back"""


class StartDialog(ModalScreen[str | None]):
    """Choose an experiment, see what torque it commands, confirm by another key; gives its name or None."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape", "back", "Back"),
        Binding("y", "confirm", "Yes", priority=True),
    ]

    def __init__(self, choices: Sequence[Choice], out: str) -> None:
        super().__init__()
        self._names = [choice.name for choice in choices]
        self._summaries = ["\n".join(map(printable, choice.summary.splitlines())) for choice in choices]
        self._out = out
        self._chosen: str | None = None

    def compose(self) -> ComposeResult:
        """Yield the list of experiments, with room for what one commands and for the question."""
        with Vertical(classes="dialog"):
            yield Static("Start an experiment: arrows and Enter choose, Esc goes back", classes="lead")
            yield OptionList(
                *(Option(_offer(" ", name), id=str(number)) for number, name in enumerate(self._names)), markup=False
            )
            yield Static("", id="summary", markup=False)
            yield Static("", id="question", markup=False)

    def on_option_list_option_highlighted(self, event: OptionList.OptionHighlighted) -> None:
        """Tell what the experiment under the bar would command."""
        self._chosen = None
        for number, name in enumerate(self._names):
            pointer = ">" if number == event.option_index else " "
            event.option_list.replace_option_prompt_at_index(number, _offer(pointer, name))
        self.query_one("#summary", Static).update(self._summaries[event.option_index])
        self.query_one("#question", Static).update("")

    def on_option_list_option_selected(self, event: OptionList.OptionSelected) -> None:
        """Ask for the key that confirms; nothing is started yet."""
        self._chosen = self._names[event.option_index]
        question = f"Arm both drives and run {self._chosen}, recorded in {self._out}? Press y for yes, Esc for no."
        self.query_one("#question", Static).update(printable(question))

    def action_confirm(self) -> None:
        """Start what was chosen; without a choice the key does nothing."""
        if self._chosen is not None:
            self.dismiss(self._chosen)

    def action_back(self) -> None:
        """Close it; nothing is started."""
        self.dismiss(None)


def _offer(pointer: str, name: str) -> str:
    return f"{pointer} {printable(name)}"


class MarkDialog(ModalScreen[str | None]):
    """Ask what a mark says; Enter with nothing is a mark too. Gives the text, or None for no mark."""

    BINDINGS: ClassVar[list[BindingType]] = [Binding("escape", "back", "Back")]

    def compose(self) -> ComposeResult:
        """Yield a line to write in."""
        with Vertical(classes="dialog"):
            yield Static("Mark (its time is that of the key m). What happened?", classes="lead")
            yield Input(placeholder="mark", max_length=200)
            yield Static("Enter keeps it, Esc drops it. Ctrl-C ends the run, as everywhere.")

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Give the text; "mark" where nothing was written."""
        self.dismiss(event.value.strip() or "mark")

    def action_back(self) -> None:
        """Close it without a mark."""
        self.dismiss(None)


class HelpDialog(ModalScreen[None]):
    """The keys, and what the words mean."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape,question_mark,enter,q", "back", "Back"),
        Binding("space,x", "app.stop", "Stop"),
    ]

    def __init__(self, text: str) -> None:
        super().__init__()
        self._text = text

    def compose(self) -> ComposeResult:
        """Yield the text."""
        with Vertical(classes="dialog"):
            yield Static(self._text, markup=False)

    def action_back(self) -> None:
        """Close it."""
        self.dismiss(None)


def key_line(page: str, can_drive: bool) -> str:
    """Name the keys that do something on a page, and the page among its fellows."""
    driving = DRIVING_KEYS if can_drive else "a recording is played  "
    here = f"TAB page {PAGES.index(page) + 1}/{len(PAGES)}  "
    return driving + here + (SCROLL_KEYS if page == "log" else VIEWING_KEYS)
