"""All rules over one file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from drivers.capability.plan import DrivePlan, plan_drive
from drivers.datasheet.file import DataSheet, read_commissioning
from drivers.datasheet.objects import EdsObject, objects_of_use, read_objects
from drivers.datasheet.text import ADVICE, EdsFinding, EdsText, EdsUnreadable, Severity, read_eds_text
from drivers.eds_check.context import SAMPLE_NODE_ID, EdsContext, at_file
from drivers.eds_check.entries import check_entries, check_sections
from drivers.eds_check.needs import ALWAYS_USED, RigLine, check_modes, check_needs, rig_lines
from drivers.eds_check.pdos import check_carriers, check_pdos

RULES = (check_sections, check_entries, check_pdos, check_needs, check_modes, check_carriers)


@dataclass(frozen=True, slots=True)
class EdsReport:
    """What a check came to."""

    path: Path  # the file
    findings: tuple[EdsFinding, ...]  # in the order of the file's lines
    plan: DrivePlan | None = None  # what a drive with it has, and how it is used
    lines: tuple[RigLine, ...] = ()  # what the rig file has to say of it

    @property
    def usable(self) -> bool:
        """Whether a drive can be run with it: there is no error among the findings."""
        return self.count(Severity.ERROR) == 0

    def count(self, severity: Severity) -> int:
        """Count the findings of a severity."""
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
    context = _context(text, objects)
    findings = _in_order(_findings(context))
    return EdsReport(path, findings, context.plan, rig_lines(context.plan))


def _context(text: EdsText, objects: Mapping[int, EdsObject]) -> EdsContext:
    commissioning = read_commissioning(text)
    node_id = None if commissioning is None else commissioning.node_id
    plan = plan_drive(DataSheet(text.path, objects_of_use(objects), node_id or SAMPLE_NODE_ID, commissioning))
    replaced = {carrier.layout.mapping_index for carrier in plan.carriers if carrier.mapped_here}
    return EdsContext(text, objects, plan, (plan.used | ALWAYS_USED) - replaced)


def _findings(context: EdsContext) -> tuple[EdsFinding, ...]:
    return (*context.text.findings, *(finding for rule in RULES for finding in rule(context)))


def _in_order(findings: tuple[EdsFinding, ...]) -> tuple[EdsFinding, ...]:
    return tuple(sorted(findings, key=lambda finding: finding.line or 0))
