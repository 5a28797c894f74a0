"""What a check of an EDS came to: lines as a compiler writes them, the capability table, and the same for JSON."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from drivers.capability.carrier import RPDO, TPDO
from drivers.capability.plan import Ability
from drivers.datasheet.text import Severity
from drivers.eds_check import EdsReport
from hil.report.numbers import as_json, fields_as_json


def eds_lines(report: EdsReport) -> Iterator[str]:
    """Write one line per finding, ``FILE:LINE: error: ...``, and one for the verdict."""
    for finding in report.findings:
        severity = finding.severity.value
        line = "" if finding.line is None else f"{finding.line}:"
        yield f"{report.path}:{line} {severity}: {finding}"
    yield from _table(report)
    yield f"{report.path}: {verdict(report)}"


def _table(report: EdsReport) -> Iterator[str]:
    """Write the capability table of a drive that can be used, and the lines its rig file needs."""
    if report.plan is None or not report.usable:
        return
    for ability in report.plan.abilities.values():
        row = ability.capability
        yield f"{row.function.value:32} {_by(ability) or f'none: {row.instead}{_cost(row.cost)}'}"
    for direction in (RPDO, TPDO):
        for carrier in report.plan.pdos(direction):
            how = "mapped by each run" if carrier.mapped_here else "as described"
            yield f"{direction.name:32} 0x{carrier.layout.communication_index:04X}, {how}: {carrier.layout}"
    if report.lines:
        yield "# under [inverters.m1] and [inverters.m2] of the rig file:"
        yield from (f"{line.text}  # {line.reason}" for line in report.lines)


def _by(ability: Ability) -> str:
    return ", ".join(f"0x{part.index:04X}:{part.subindex:02X}" for part in ability.parts)


def _cost(cost: str) -> str:
    return f" ({cost})" if cost else ""


def verdict(report: EdsReport) -> str:
    """Say whether the file is usable, and count the findings: ``not usable: 1 error, 2 warnings``."""
    usable = "usable with the lines above" if report.lines else "usable"
    counts = [f"{n} {each.value}{'' if n == 1 else 's'}" for each in Severity if (n := report.count(each))]
    return f"{usable if report.usable else 'not usable'}: {', '.join(counts) or 'nothing to remark'}"


def eds_section(report: EdsReport) -> dict[str, Any]:
    """Give one file's part of the document ``hil.eds_check/1``."""
    return {
        "file": str(report.path),
        "usable": report.usable,
        "findings": as_json(report.findings),
        "rig_file_lines": [{"line": line.text, "reason": line.reason} for line in report.lines],
        "capabilities": [] if report.plan is None else [_ability(each) for each in report.plan.abilities.values()],
    }


def _ability(ability: Ability) -> dict[str, Any]:
    row = ability.capability
    return {
        "function": row.function.value,
        "by": [f"0x{part.index:04X}:{part.subindex:02X}" for part in ability.parts],
        **fields_as_json(row, "without", "instead", "cost", "key"),
    }
