"""docs/gallery.md: what the tool says of each failure, put where the page has its place for it."""

import re
from pathlib import Path

from tests.docs.gallery.case import Failure, Outcome
from tests.docs.gallery.draw import FOLDER
from tests.docs.gallery.file_failures import FILES
from tests.docs.gallery.recording_failures import RECORDINGS
from tests.docs.gallery.rig_failures import RIG

PAGE = Path(__file__).parents[3] / "docs" / "gallery.md"
FAILURES: dict[str, Failure] = {failure.name: failure for failure in (*RIG, *RECORDINGS, *FILES)}

_SHOWN = re.compile(r"<!-- shown: (?P<name>\w+) -->\n(?P<shown>.*?)<!-- end -->", re.S)


def shown_of(name: str, outcome: Outcome) -> str:
    """Return what stands on the page of one failure, as Markdown."""
    typed = "\n".join(f"$ {line}" for line in outcome.command.splitlines())
    picture = (
        "" if outcome.draw is None else f"\n![Torque and speed: {name.replace('_', ' ')}](images/gallery/{name}.svg)\n"
    )
    return f"```console\n{typed}\n{outcome.text}\n```\n\nExit status {outcome.status}.\n{picture}"


def shown_on_page() -> dict[str, str]:
    """Return what the page shows of each failure."""
    return {match["name"]: match["shown"] for match in _SHOWN.finditer(PAGE.read_text(encoding="utf-8"))}


def with_shown(text: str, name: str, shown: str) -> str:
    """Return the page's text with what one failure shows now."""

    def renewed(match: re.Match[str]) -> str:
        return f"<!-- shown: {name} -->\n{shown}<!-- end -->" if match["name"] == name else match[0]

    return _SHOWN.sub(renewed, text)


def pictures() -> set[str]:
    """Return the names of the pictures that are there."""
    return {path.stem for path in FOLDER.glob("*.svg")}
