"""The facts of docs/catalogue.md, as the catalogue has them.

Run it to bring the page up to date: ``python tests/docs/catalogue_page.py`` rewrites what stands between
``<!-- facts: NAME -->`` and ``<!-- end -->``; the text around it is written by people.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

from estimator.physics.catalogue import EFFECTS
from estimator.physics.effect import Effect, EffectParameter
from estimator.physics.model import Motion

PAGE = Path(__file__).parents[2] / "docs" / "catalogue.md"

_FACTS = re.compile(r"<!-- facts: (?P<name>\w+) -->\n(?P<facts>.*?)<!-- end -->", re.S)


def facts_of(entry: Effect) -> str:
    """Return what the catalogue says of one effect, as Markdown."""
    rows = [
        ("element", f"`{entry.element.value}`"),
        ("excited by", entry.excited_by),
        ("resembles", _names(entry.resembles)),
        ("the same to torque and speed", _names(entry.equivalent)),
        ("contains", _names(entry.contains)),
        ("structures", ", ".join(f"`{structure.value}`" for structure in sorted(entry.structures, key=str))),
        ("source", entry.source),
    ]
    lines = ["```text", entry.law, "```", "", "| | |", "| --- | --- |"]
    lines += [f"| {label} | {text} |" for label, text in rows if text]
    lines += ["", "| parameter | unit | no effect at | meaning |", "| --- | --- | --- | --- |"]
    lines += [_parameter(parameter) for parameter in entry.parameters]
    return "\n".join(lines) + "\n"


def _names(names: tuple[str, ...]) -> str:
    return ", ".join(f"`{name}`" if name in EFFECTS else f"{name} (not in the catalogue yet)" for name in names)


def _parameter(parameter: EffectParameter) -> str:
    unit = " or ".join(dict.fromkeys(parameter.unit(motion) for motion in Motion))
    name = f"`{parameter.name}`" + (", optional" if parameter.optional else "")
    return f"| {name} | {unit} | {parameter.null:g} | {parameter.meaning} |"


def facts_on_page() -> dict[str, str]:
    """Return what the page says of each effect."""
    return {match["name"]: match["facts"] for match in _FACTS.finditer(PAGE.read_text(encoding="utf-8"))}


def up_to_date(text: str) -> str:
    """Return the page's text with the facts of today; a section without an entry stays as it is."""

    def renewed(match: re.Match[str]) -> str:
        entry = EFFECTS.get(match["name"])
        facts = match["facts"] if entry is None else facts_of(entry)
        return f"<!-- facts: {match['name']} -->\n{facts}<!-- end -->"

    return _FACTS.sub(renewed, text)


if __name__ == "__main__":
    PAGE.write_text(up_to_date(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
    sys.stdout.write(f"{PAGE}: {len(EFFECTS)} effects\n")
