"""What is written of a real recording: ``real.json``, schema ``hil.real/1``."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hil.files import read_json
from hil.proof.real.judge import Agreement
from hil.report.numbers import json_number

SCHEMA = "hil.real/1"
FILE_NAME = "real.json"


@dataclass(frozen=True, slots=True)
class Errors:
    """Error of the nominal model, re-tuned, and of the model with what was found, in the case's measure.

    Attributes
    ----------
    before, after
        By recording.
    """

    before: Mapping[str, float] = field(default_factory=dict)
    after: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class BlackBoxFigure:
    """Error of a black box on the same held-out samples by recording; a reason where there is none."""

    name: str
    held_out: Mapping[str, float] = field(default_factory=dict)
    reason: str | None = None


@dataclass(frozen=True, slots=True)
class RunResult:
    """One diagnosis of a case.

    Attributes
    ----------
    named
        Effects of the verdict.
    unit
        Of the errors; empty where they are normalised.
    diagnosis, report
        Paths of ``diagnosis.json`` and ``report.html``, relative to the folder of ``real.json``.
    fault
        Why a command did not do its job; then there is nothing else.
    """

    name: str
    verdict: str | None = None
    named: Sequence[str] = ()
    statement: str = ""
    unit: str = ""
    fit: Errors = field(default_factory=Errors)
    held_out: Errors = field(default_factory=Errors)
    grade_correlation: float | None = None
    agreements: Sequence[Agreement] = ()
    black_boxes: Sequence[BlackBoxFigure] = ()
    diagnosis: str | None = None
    report: str | None = None
    duration_s: float = 0.0
    fault: str | None = None


@dataclass(frozen=True, slots=True)
class RealResult:
    """Everything about one case.

    Attributes
    ----------
    measure
        Of all its errors.
    agreements
        Over all runs; those of single runs are with them.
    """

    name: str
    title: str
    concealed: Sequence[str]
    conceals: str
    measure: str
    runs: Sequence[RunResult]
    agreements: Sequence[Agreement] = ()

    @property
    def named_right(self) -> bool:
        """Whether every run named what is concealed, and nothing else."""
        return all(run.fault is None and set(run.named) == set(self.concealed) for run in self.runs)


def to_json(results: Sequence[RealResult]) -> str:
    """Return the text of ``real.json``; a number that is not finite is null."""
    cases = [{**_plain(result), "named_right": result.named_right} for result in results]
    return json.dumps({"schema": SCHEMA, "cases": cases}, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def _plain(value: Any) -> Any:
    """Return dataclasses, mappings and sequences as JSON types."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {entry.name: _plain(getattr(value, entry.name)) for entry in dataclasses.fields(value)}
    if isinstance(value, Mapping):
        return {key: _plain(entry) for key, entry in value.items()}
    if isinstance(value, str) or value is None or isinstance(value, bool):
        return value
    if isinstance(value, Sequence):
        return [_plain(entry) for entry in value]
    return json_number(float(value))


def write_results(results: Sequence[RealResult], path: Path) -> None:
    """Write ``real.json``, whole or not at all."""
    part = path.with_name(f".{path.name}.part")
    part.write_text(to_json(results), encoding="utf-8")
    part.replace(path)


def read_results(path: Path) -> list[RealResult]:
    """Read ``real.json`` back; an error that was not finite comes back as infinity.

    Raises
    ------
    ValueError
        If the file is of another schema.
    """
    content = read_json(path)
    if content.get("schema") != SCHEMA:
        raise ValueError(f"{path}: expected the schema {SCHEMA}, got {content.get('schema')!r}. Make it again.")
    return [_result(case) for case in content["cases"]]


def run_json(run: RunResult) -> dict[str, Any]:
    """Return one run as JSON types; `run_from` reads it back."""
    plain: dict[str, Any] = _plain(run)
    return plain


def _result(case: Mapping[str, Any]) -> RealResult:
    fields_ = {key: value for key, value in case.items() if key != "named_right"}
    runs = tuple(run_from(run) for run in case["runs"])
    nested = {"concealed": tuple(case["concealed"]), "runs": runs, "agreements": _agreements(case["agreements"])}
    return RealResult(**{**fields_, **nested})


def run_from(run: Mapping[str, Any]) -> RunResult:
    """Return the run that `run_json` was made of."""
    nested = {
        "named": tuple(run["named"]),
        "fit": _errors(run["fit"]),
        "held_out": _errors(run["held_out"]),
        "agreements": _agreements(run["agreements"]),
        "black_boxes": tuple(
            BlackBoxFigure(box["name"], _finite(box["held_out"]), box["reason"]) for box in run["black_boxes"]
        ),
    }
    return RunResult(**{**run, **nested})


def _errors(stages: Mapping[str, Mapping[str, float | None]]) -> Errors:
    return Errors(_finite(stages["before"]), _finite(stages["after"]))


def _finite(values: Mapping[str, float | None]) -> dict[str, float]:
    return {key: math.inf if value is None else value for key, value in values.items()}


def _agreements(entries: Sequence[Mapping[str, Any]]) -> tuple[Agreement, ...]:
    return tuple(
        Agreement(**{**entry, "ci95": None if entry["ci95"] is None else tuple(entry["ci95"])}) for entry in entries
    )
