"""What a check of an EDS came to: lines as a compiler writes them, and the same for JSON."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import typer

from drivers.datasheet.check import EdsReport
from drivers.datasheet.finding import EdsFinding, Severity

_COLOURS = {Severity.ERROR: "red", Severity.WARNING: "yellow", Severity.NOTE: "cyan"}


def eds_lines(report: EdsReport) -> Iterator[str]:
    """Write one line per finding, ``FILE:LINE: error: ...``, and one for the verdict.

    Colours are in the text; `typer.echo` takes them out where no terminal reads it.
    """
    for finding in report.findings:
        severity = typer.style(finding.severity.value, fg=_COLOURS[finding.severity], bold=True)
        line = "" if finding.line is None else f"{finding.line}:"
        yield f"{report.path}:{line} {severity}: {finding}"
    yield f"{report.path}: {verdict(report)}"


def verdict(report: EdsReport) -> str:
    """Say whether the file is usable, and count the findings: ``not usable: 1 error, 2 warnings``."""
    counts = [f"{n} {each.value}{'' if n == 1 else 's'}" for each in Severity if (n := report.count(each))]
    return f"{'usable' if report.usable else 'not usable'}: {', '.join(counts) or 'nothing to remark'}"


def eds_section(report: EdsReport) -> dict[str, Any]:
    """Give one file's part of the document ``hil.eds_check/1``."""
    return {
        "file": str(report.path),
        "usable": report.usable,
        "findings": [_finding(finding) for finding in report.findings],
    }


def _finding(finding: EdsFinding) -> dict[str, Any]:
    return {
        "severity": finding.severity.value,
        "line": finding.line,
        "place": finding.place,
        "expected": finding.expected,
        "found": finding.found,
        "advice": finding.advice,
    }
