"""All rules over one file."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from drivers.datasheet.check.carriers import carrier_parameters, check_carriers
from drivers.datasheet.check.context import EdsContext, at_file
from drivers.datasheet.check.entries import check_entries
from drivers.datasheet.check.lists import check_lists
from drivers.datasheet.check.modes import check_modes
from drivers.datasheet.check.needs import USED, check_needs
from drivers.datasheet.check.pdos import check_pdos
from drivers.datasheet.check.sections import check_sections
from drivers.datasheet.check.values import check_values
from drivers.datasheet.finding import EdsFinding, Severity
from drivers.datasheet.objects import read_objects
from drivers.datasheet.text import ADVICE, EdsUnreadable, read_eds_text

RULES = (check_sections, check_lists, check_entries, check_values, check_pdos, check_needs, check_modes, check_carriers)


@dataclass(frozen=True, slots=True)
class EdsReport:
    """What a check came to.

    Attributes
    ----------
    path
        The file.
    findings
        In the order of the file's lines; what has no line comes first.
    """

    path: Path
    findings: tuple[EdsFinding, ...]

    @property
    def usable(self) -> bool:
        """Whether a drive can be run with it: there is no error among the findings."""
        return self.count(Severity.ERROR) == 0

    def count(self, severity: Severity) -> int:
        """Count the findings of one severity."""
        return sum(finding.severity is severity for finding in self.findings)


def check_eds(path: Path) -> EdsReport:
    """Check one EDS; a file that can't be read is one error."""
    try:
        text = read_eds_text(path)
    except EdsUnreadable as error:
        return EdsReport(path, (at_file(Severity.ERROR, "file", "an EDS (CiA 306)", error.found, error.advice),))
    objects = read_objects(text)
    if not objects:
        none = at_file(Severity.ERROR, "file", "objects, in sections such as [1000]", "none", ADVICE)
        return EdsReport(path, (none,))
    return EdsReport(path, _in_order(_findings(EdsContext(text, objects, frozenset()))))


def _findings(context: EdsContext) -> tuple[EdsFinding, ...]:
    context = replace(context, used=USED | carrier_parameters(context))
    return (*context.text.findings, *(finding for rule in RULES for finding in rule(context)))


def _in_order(findings: tuple[EdsFinding, ...]) -> tuple[EdsFinding, ...]:
    return tuple(sorted(findings, key=lambda finding: finding.line or 0))
