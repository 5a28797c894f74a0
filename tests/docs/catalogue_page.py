"""The facts of docs/catalogue.md, as the catalogue has them.

Run it to bring the page up to date: ``python tests/docs/catalogue_page.py`` rewrites what stands between
``<!-- facts: NAME -->`` and ``<!-- end -->``; the text around it is written by people.
"""

import re
import sys
from pathlib import Path

from estimator.physics.catalogue import EFFECTS
from estimator.physics.effect import Effect, EffectParameter
from hil.report.catalogue import bounds_text, null_text, structures_text, unit_text

PAGE = Path(__file__).parents[2] / "docs" / "catalogue.md"

USUAL = "one_mass, two_mass, three_mass"
"""Structures that the page names at its head, once."""

_FACTS = re.compile(r"<!-- facts: (?P<name>\w+) -->\n(?P<facts>.*?)<!-- end -->", re.S)


def facts_of(entry: Effect) -> str:
    """Return what the catalogue says of one effect, as Markdown."""
    structures = structures_text(entry)
    sentences = [
        ("Excited by", entry.excited_by),
        ("Confused with", _names(entry.resembles)),
        ("The same to torque and speed:", _names(entry.equivalent)),
        ("Contains", _names(entry.contains)),
        ("Structures:", "" if structures == USUAL else structures),
        ("Source:", entry.source),
    ]
    return "\n".join(
        [
            *("```text", entry.law, "```", ""),
            *(f"![{entry.title}](images/effects/{entry.name}.svg)", ""),
            *(" ".join(f"**{label}** {text}." for label, text in sentences if text), ""),
            *(_parameter(entry, parameter) for parameter in entry.parameters),
            "",
        ]
    )


def _names(names: tuple[str, ...]) -> str:
    return ", ".join(f"[`{name}`](#{name})" for name in names)


def _parameter(entry: Effect, parameter: EffectParameter) -> str:
    """Return a line of the list: name, unit, null, bounds, meaning."""
    unit = "" if unit_text(parameter) == "–" else f" [{unit_text(parameter)}]"
    optional = ", optional" if parameter.optional else ""
    bounds = bounds_text(entry, parameter).removesuffix(" scales")
    return f"- `{parameter.name}`{unit}{optional}, {null_text(parameter)} ({bounds}): {parameter.meaning}"


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
