"""What a worker does: read recordings, diagnose or identify, and return rows. Nothing here knows of Dask."""

from __future__ import annotations

import hashlib
import json
import os
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path

from threadpoolctl import threadpool_limits

from estimator.diagnosis.diagnose import diagnose
from estimator.errors import EstimatorError
from estimator.identification.modes.modes import two_mass_resonance
from estimator.identification.settings import Settings
from estimator.physics.model import Structure
from estimator.physics.parallel import work_on
from estimator.signals.record import Record
from hil.config.model_file import ModelFile
from hil.errors import HilError
from hil.fleet.dataset import DatasetRow
from hil.fleet.sources import FleetRecording, Seen, seen, side_by_side
from hil.plants.scales import with_lines, with_the_line_to_write
from hil.recording import read_records
from hil.report.diagnosis_json import diagnosis_json
from hil.report.identification_files import identify_all
from hil.report.identification_json import identification_text
from hil.version import __version__

DIAGNOSE, IDENTIFY = "diagnose", "identify"

PATIENCE = 3.0
"""Times its limit after which a task that does not end by itself takes its worker with it."""

TWO_MASS = ("J_M", "J_L", "k", "c", "b_M", "b_L")


@dataclass(frozen=True, slots=True)
class FleetJob:
    """What is done to every recording; ``file`` is None where they are identified as they are."""

    command: str  # `DIAGNOSE` or `IDENTIFY`
    file: ModelFile | None  # its [signals] are how foreign recordings are read
    model: str = ""  # name of the model file; empty without one
    model_sha256: str = ""  # of the model file as it is; empty without one
    from_fleet: tuple[str, ...] = ()  # parameters of the model that the fleet's prior has set
    effort: str = "normal"  # level of a diagnosis, as --effort has it
    budget_s: float = 3600.0  # of each recording, or of a vehicle's together
    version: str = __version__  # of the client; a worker of another refuses

    def key(self, recordings: Sequence[FleetRecording]) -> str:
        """Return what a result is known by: the content of the recordings, the model's, the effort and the version."""
        parameters = {} if self.file is None else {k: asdict(v) for k, v in self.file.model.parameters.items()}
        contents = sorted(each.sha256 for each in recordings)
        said = [self.command, contents, self.model_sha256, parameters, self.effort, self.version]
        return hashlib.sha256(json.dumps(said).encode()).hexdigest()


@dataclass(frozen=True, slots=True)
class Outcome:
    """Rows and verdict of one piece of work; what was wrong with its input, or empty."""

    rows: dict[str, list[DatasetRow]]  # by name of the dataset's table; empty with an error
    verdict: str  # diagnosis.json or identification.json, as text
    error: str = ""  # in words


def describe(found: FleetRecording, limit_s: float) -> Seen | str:
    """Return what a recording's file says, or what is wrong with it; the worker ends where that takes too long."""
    try:
        with _ended_after(limit_s):
            return seen(found.url)
    except HilError as error:
        return str(error)


def analyse(recordings: Sequence[FleetRecording], job: FleetJob) -> Outcome:
    """Diagnose or identify recordings of one vehicle, on one core."""
    if job.version != __version__:
        return Outcome({}, "", f"expected a worker of hil {job.version}, got one of hil {__version__}")
    work_on(1)
    started_s = time.monotonic()
    try:
        with (
            _ended_after(PATIENCE * job.budget_s),
            side_by_side(recordings) as paths,
            threadpool_limits(1, user_api="blas"),  # how many threads add up shows in the last bits
        ):
            signals = None if job.file is None else job.file.signals
            records = read_records(paths, signals, job.file is not None and job.file.on_bench)
            if job.command == IDENTIFY or job.file is None:
                made = _identified(records)
            else:
                with with_the_line_to_write(paths, signals):
                    made = _diagnosed(records, job.file, job, paths)
    except (HilError, EstimatorError) as error:
        return Outcome({}, "", " ".join((str(error), *getattr(error, "__notes__", ()))))
    head, effects, parameters, verdict = made
    head |= {
        "n_recordings": len(records),
        "n_samples": sum(int(each.okay.sum()) for each in records),
        "duration_s": sum(float(each.time_s[-1] - each.time_s[0]) for each in records),
        "seconds": time.monotonic() - started_s,
    }
    of, tables = row_of(recordings, job), {"recordings": [head], "effects": effects, "parameters": parameters}
    return Outcome({name: [of | row for row in rows] for name, rows in tables.items()}, verdict)


def row_of(recordings: Sequence[FleetRecording], job: FleetJob) -> DatasetRow:
    """Return the columns that say of what and by what a row is."""
    return {
        "key": job.key(recordings),
        **place(recordings),
        "sha256": " ".join(each.sha256 for each in recordings),
        "model": job.model,
        "model_sha256": job.model_sha256,
        "from_fleet": " ".join(job.from_fleet),
        "version": job.version,
    }


def place(recordings: Sequence[FleetRecording]) -> DatasetRow:
    """Return the columns that say where what was found belongs."""
    first = min(recordings, key=lambda each: (each.started, each.url))
    return {
        "vehicle": first.vehicle,
        "rig": first.rig,
        "started": first.started,
        "name": first.name if len(recordings) == 1 else f"{len(recordings)} recordings",
        "url": " ".join(each.url for each in recordings),
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


ResultRows = tuple[DatasetRow, list[DatasetRow], list[DatasetRow], str]
"""Columns of the recording, rows of its effects and of parameters, and the verdict."""


def _diagnosed(records: Sequence[Record], file: ModelFile, job: FleetJob, paths: Sequence[Path]) -> ResultRows:
    found = diagnose(records, file.model, (), budget_s=job.budget_s, effort=job.effort)
    found = with_lines(found, paths, file.signals)
    if not found.effort.finished:
        raise HilError(f"expected a diagnosis within {job.budget_s:g} s (--budget-s), got none. Give it more time.")
    content = diagnosis_json(found) | {"timing_s": {}}  # the same on every machine, to the last bit
    fit, effects, line = content["fit"], content["effects"], content["parameters"]
    head = {name: content[name] for name in ("verdict", "statement")} | {
        "element": content["mismatch"]["element"] or "",
        "effects": " ".join(each["name"] for each in effects),
        **{f"fit_{name}": fit[name] for name in ("unit", "nominal", "retuned", "augmented")},
        "noise_floor": fit["noise_floor"],
        "effort": found.effort.level,
        "simulations": found.effort.simulations,
    }
    if found.augmented.structure is Structure.TWO_MASS and set(line) == set(TWO_MASS):
        mode = two_mass_resonance(**{name: found.parameters[name].value for name in TWO_MASS})
        head |= {} if mode is None else {"frequency_hz": mode.frequency_hz, "damping": mode.damping}
    parameters = [
        *_parameters("", line),
        *(row for each in effects for row in _parameters(each["name"], each["parameters"])),
    ]
    text = json.dumps(content, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
    return head, [_effect(each) for each in effects], parameters, text


def _effect(each: DatasetRow) -> DatasetRow:
    return {
        "effect": each["name"],
        "form": each.get("form", ""),
        "indistinguishable_from": " ".join(each["indistinguishable_from"]),
        **{name: each[name] for name in ("element", "probability", "share")},
        **{name: each["evidence"][name] for name in ("delta_bic", "p_value")},
    }


def _parameters(effect: str, parameters: Mapping[str, DatasetRow]) -> Iterator[DatasetRow]:
    """Yield a row for each parameter as the JSON files have it."""
    for name, each in parameters.items():
        low, high = each["ci95"] or (None, None)
        known = {column: each.get(column) for column in ("value", "nominal", "unit")}
        yield {"effect": effect, "parameter": name, "low": low, "high": high, **known}


def _identified(records: Sequence[Record]) -> ResultRows:
    settings = Settings()
    studies = identify_all(records, settings)
    text = identification_text([each.found for each in studies], settings, None, studies)
    (found,) = json.loads(text)["recordings"]
    best = found["best"]
    line = {
        "frequency_hz": {"value": best["frequency_hz"], "ci95": best["frequency_ci95_hz"], "unit": "Hz"},
        "damping": {"value": best["damping"], "ci95": best["damping_ci95"], "unit": ""},
        **{name: each for name, each in found["physical"]["parameters"].items() if each["determined"]},
    }
    head = {name: best[name] for name in ("verdict", "statement", "frequency_hz", "damping")}
    return head, [], list(_parameters("", line)), text
