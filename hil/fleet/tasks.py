"""What a worker does: read recordings, diagnose or identify, and return rows. Nothing here knows of Dask."""

from __future__ import annotations

import hashlib
import json
import os
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from typing import Any

from threadpoolctl import threadpool_limits

from estimator.diagnosis.diagnose import diagnose
from estimator.diagnosis.result import Diagnosis
from estimator.errors import EstimatorError
from estimator.identification.modes.modes import two_mass_resonance
from estimator.identification.settings import Settings
from estimator.identification.study import Study
from estimator.physics.model import Structure
from estimator.physics.parallel import work_on
from estimator.signals.record import Record
from hil.config.model_file import ModelFile
from hil.errors import HilError
from hil.fleet.dataset import Row
from hil.fleet.sources import Found, described, side_by_side
from hil.plants.scales import with_the_line_to_write
from hil.recording import read_records
from hil.report.diagnosis_json import diagnosis_json
from hil.report.identification_files import identify_all
from hil.report.identification_json import identification_text
from hil.report.numbers import json_number
from hil.version import __version__

DIAGNOSE, IDENTIFY = "diagnose", "identify"

PATIENCE = 3.0
"""Times its limit after which a task that does not end by itself takes its worker with it."""


@dataclass(frozen=True, slots=True)
class Job:
    """What is done to every recording.

    Attributes
    ----------
    file : ModelFile or None
        None where recordings are identified as they are.
    from_fleet : tuple of str
        Parameters of the model that the fleet's prior has set.
    budget_s : float
        Time that one of them may take [s].
    """

    command: str
    file: ModelFile | None
    model: str = ""
    model_sha256: str = ""
    from_fleet: tuple[str, ...] = ()
    effort: str = "normal"
    budget_s: float = 3600.0
    version: str = __version__

    def key(self, recordings: Sequence[Found]) -> str:
        """Return what a result is known by: the content of the recordings, the model's, the effort and the version."""
        parameters = {} if self.file is None else {k: asdict(v) for k, v in self.file.model.parameters.items()}
        contents = sorted(each.sha256 for each in recordings)
        said = [self.command, contents, self.model_sha256, parameters, self.effort, self.version]
        return hashlib.sha256(json.dumps(said).encode()).hexdigest()


@dataclass(frozen=True, slots=True)
class Outcome:
    """Rows and verdict of one piece of work; what was wrong with its input, or empty."""

    rows: dict[str, list[Row]]
    verdict: str
    error: str = ""


def describe(found: Found) -> Found | str:
    """Return a recording with its checksum and place in the fleet, or what is wrong with it."""
    try:
        return described(found)
    except HilError as error:
        return str(error)


def analyse(recordings: Sequence[Found], job: Job) -> Outcome:
    """Diagnose or identify recordings of one vehicle, on one core."""
    if job.version != __version__:
        return Outcome({}, "", f"expected a worker of hil {job.version}, got one of hil {__version__}")
    work_on(1)
    begun = time.monotonic()
    try:
        with (
            _ended_after(PATIENCE * job.budget_s),
            side_by_side(recordings) as paths,
            threadpool_limits(1, user_api="blas"),  # how many threads add up shows in the last bits
        ):
            signals = None if job.file is None else job.file.signals
            records = read_records(paths, signals, job.file is not None and job.file.on_bench)
            if job.command == IDENTIFY:
                made = _identified(records)
            else:
                with with_the_line_to_write(paths, signals):
                    made = _diagnosed(records, job)
    except (HilError, EstimatorError) as error:
        return Outcome({}, "", " ".join((str(error), *getattr(error, "__notes__", ()))))
    head, rows, verdict = made
    of = row_of(recordings, job)
    timed = {"seconds": time.monotonic() - begun, "n_recordings": len(records), **head}
    sizes = {
        "n_samples": sum(int(each.okay.sum()) for each in records),
        "duration_s": sum(float(each.time_s[-1] - each.time_s[0]) for each in records),
    }
    tables = {name: [{**of, **row} for row in rows.get(name, ())] for name in ("effects", "parameters")}
    return Outcome({"recordings": [{**of, **sizes, **timed}], **tables}, verdict)


def row_of(recordings: Sequence[Found], job: Job) -> Row:
    """Return the columns that say of what and by what a row is."""
    first = min(recordings, key=lambda each: (each.started, each.url))
    return {
        "key": job.key(recordings),
        "vehicle": first.vehicle,
        "rig": first.rig,
        "started": first.started,
        "name": first.name if len(recordings) == 1 else f"{len(recordings)} recordings",
        "url": " ".join(each.url for each in recordings),
        "sha256": " ".join(each.sha256 for each in recordings),
        "model": job.model,
        "model_sha256": job.model_sha256,
        "from_fleet": " ".join(job.from_fleet),
        "version": job.version,
    }


@contextmanager
def _ended_after(limit_s: float) -> Iterator[None]:
    """End this process where a task does not end: Dask starts another worker, and gives up on the task after a few."""
    timer = threading.Timer(limit_s, os._exit, (1,))
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()


Made = tuple[Row, dict[str, list[Row]], str]


def _diagnosed(records: Sequence[Record], job: Job) -> Made:
    file = job.file
    if file is None:
        raise TypeError("a diagnosis is of a model")
    found = diagnose(records, file.model, (), budget_s=job.budget_s, effort=job.effort)
    if not found.effort.finished:
        raise HilError(f"expected a diagnosis within {job.budget_s:g} s (--budget-s), got none. Give it more time.")
    content = diagnosis_json(found) | {"timing_s": {}}  # the same on every machine, to the last bit
    text = json.dumps(content, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
    parameters = [*_of_line(found), *_of_effects(found)]
    return _verdict_row(found), {"effects": _effect_rows(found), "parameters": parameters}, text


def _verdict_row(found: Diagnosis) -> Row:
    fit, element = found.fit, found.mismatch.element
    line = {name: each.value for name, each in found.parameters.items()}
    is_two_mass = found.augmented.structure is Structure.TWO_MASS
    mode = two_mass_resonance(**line) if is_two_mass and len(line) == len(TWO_MASS) else None
    return {
        "verdict": found.verdict.value,
        "statement": found.statement,
        "element": "" if element is None else element.value,
        "effects": " ".join(each.name for each in found.effects),
        "fit_unit": fit.unit,
        "fit_nominal": json_number(fit.nominal),
        "fit_retuned": json_number(fit.retuned),
        "fit_augmented": json_number(fit.augmented),
        "noise_floor": json_number(fit.noise_floor),
        "effort": found.effort.level,
        "simulations": found.effort.simulations,
        **({} if mode is None else {"frequency_hz": mode.frequency_hz, "damping": mode.damping}),
    }


TWO_MASS = ("J_M", "J_L", "k", "c", "b_M", "b_L")


def _effect_rows(found: Diagnosis) -> list[Row]:
    return [
        {
            "effect": each.name,
            "form": each.form,
            "element": each.element.value,
            "probability": json_number(each.probability),
            "share": json_number(each.share),
            "delta_bic": json_number(each.evidence.delta_bic),
            "p_value": json_number(each.evidence.p_value),
            "indistinguishable_from": " ".join(each.indistinguishable_from),
        }
        for each in found.effects
    ]


def _of_line(found: Diagnosis) -> Iterator[Row]:
    for name, each in found.parameters.items():
        yield _parameter("", name, each.value, each.ci95, each.unit) | {"nominal": json_number(each.nominal)}


def _of_effects(found: Diagnosis) -> Iterator[Row]:
    for effect in found.effects:
        for name, each in effect.parameters.items():
            yield _parameter(effect.name, name, each.value, each.ci95, each.unit)


def _parameter(effect: str, name: str, value: float, ci95: tuple[float, float], unit: str) -> Row:
    low, high = (json_number(end) for end in ci95)
    return {"effect": effect, "parameter": name, "value": json_number(value), "low": low, "high": high, "unit": unit}


def _identified(records: Sequence[Record]) -> Made:
    settings = Settings()
    studies = identify_all(records, settings)
    text = identification_text([each.found for each in studies], settings, None, studies)
    best = json.loads(text)["recordings"][0]["best"]
    rows = list(_of_study(studies[0]))
    head = {
        "verdict": best["verdict"],
        "statement": best["statement"],
        "frequency_hz": best["frequency_hz"],
        "damping": best["damping"],
    }
    return head, {"parameters": rows}, text


def _of_study(study: Study) -> Iterator[Row]:
    mode: Any = study.best.mode
    if mode is not None:
        for name, unit in (("frequency_hz", "Hz"), ("damping", "")):
            each = getattr(mode, name)
            yield _parameter("", name, each.value, each.ci95, unit)
    if study.physical is not None:
        for name, known in study.physical.parameters.items():
            if known.is_determined:
                yield _parameter("", name, known.estimate.value, known.estimate.ci95, known.unit)
