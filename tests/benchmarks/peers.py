"""``python -m tests.benchmarks.peers --environments DIR``: accuracy beside other tools, on the same data.

SIPPY and SysIdentPy pin versions of numpy that are not ours, so each has an environment of its own in DIR, made where
it is missing by ``venv`` and ``pip`` and run as a process with an .npz going in and one coming out.

Data: cruises of the truth simulator, every one another bus, high-passed at 0.3 Hz and at their own 10 ms, the same
arrays for all. Judged on another cruise of the same bus: the free-run fit (every linear model simulated by one
routine, which estimates the free response of the time before), and resonance and damping against the truth.
"""

from __future__ import annotations

import argparse
import math
import subprocess
import sys
import tempfile
import venv
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median

import numpy as np

from estimator.errors import EstimatorError
from estimator.identification.linear_model import LinearModel
from estimator.identification.modes.modes import Mode, resonance, two_mass_resonance
from estimator.identification.offline.arx import fit_arx
from estimator.identification.offline.box_jenkins import fit_box_jenkins
from estimator.identification.offline.free_run import free_run
from estimator.identification.offline.instrumental import fit_instrumental
from estimator.identification.offline.linear_fit import fit_percent
from estimator.identification.offline.noise_model import NoiseModel
from estimator.identification.offline.output_error import fit_output_error
from estimator.signals.decimate import decimate
from estimator.signals.record import FloatArray, Record
from hil.proof.truth.bus import NOMINAL_ERROR
from hil.proof.truth.case import TESTS
from hil.proof.truth.case import record as drive
from hil.proof.truth.specimen import Specimen, draw_specimen
from tests.benchmarks.identification import FIRST_SEED, TWO_MASS
from tests.benchmarks.ratios import table

HERE = Path(__file__).parent
RUNS = 8
TIME_LIMIT_S = 900.0

OURS = {
    "ARX": fit_arx,
    "instrumental variable": fit_instrumental,
    "output error": fit_output_error,
    "Box-Jenkins": fit_box_jenkins,
}

SILENT = NoiseModel(np.ones(1), 0.0)


@dataclass(frozen=True, slots=True)
class Peer:
    """A tool: what to install, and the script that runs in its environment."""

    name: str
    requirement: str
    script: str


PEERS = (
    Peer("SIPPY", "sippy_unipi==1.0.1", "peers_sippy.py"),
    Peer("SysIdentPy", "sysidentpy==0.9.0", "peers_sysidentpy.py"),
)


@dataclass(frozen=True, slots=True)
class Pair:
    """Two cruises of one bus, prepared, and its mode."""

    fitted: Record
    fresh: Record
    mode: Mode


@dataclass(frozen=True, slots=True)
class Score:
    """Free-run fit on the fresh cruise [%] and relative errors of resonance and damping; NaN where there is none."""

    fit_percent: float
    resonance: float = math.nan
    damping: float = math.nan


def pairs(runs: int) -> Iterator[Pair]:
    """Yield the data of the comparison."""
    for seed in range(FIRST_SEED, FIRST_SEED + runs):
        specimen = draw_specimen("none", seed, NOMINAL_ERROR)
        bus = specimen.bus
        mode = two_mass_resonance(bus.J_M, bus.J_L, bus.k, bus.c, bus.b_M, bus.b_L)
        if mode is None:
            raise ValueError(f"bus {seed} does not oscillate; expected one that does")
        yield Pair(_cruise(specimen, 0), _cruise(specimen, len(TESTS)), mode)


def _cruise(specimen: Specimen, number: int) -> Record:
    driven = drive(specimen, number)
    torque_nm = np.column_stack([driven.torque_m1_nm, driven.torque_m2_nm])
    okay = np.isfinite(driven.speed_rad_s)
    return decimate(Record(f"cruise_{number}", 0.01, driven.time_s, torque_nm, driven.speed_rad_s, okay), 1)


def model_of(numerator: FloatArray, denominator: FloatArray, sample_time_s: float) -> LinearModel:
    """Return the model of polynomials in z, highest power first."""
    a = denominator / denominator[0]
    b = np.concatenate([np.zeros(max(a.shape[0] - numerator.shape[0], 0)), numerator]) / denominator[0]
    return LinearModel(tuple(a[1:].tolist()), tuple(b[1:].tolist()), 1, sample_time_s)


def score(model: LinearModel, pair: Pair) -> Score:
    """Judge a linear model; one that is not stable has no free run."""
    mode = resonance(model)
    errors = (math.nan, math.nan)
    if mode is not None:
        errors = mode.frequency_hz / pair.mode.frequency_hz - 1.0, mode.damping / pair.mode.damping - 1.0
    fit = free_run(model, pair.fresh, SILENT).fit_percent if model.is_stable else -math.inf
    return Score(fit, *errors)


def ours(pair: Pair) -> dict[str, Score]:
    """Judge every off-line estimator of this project; one that refuses the data has no free run."""
    scores = {}
    for name, fit in OURS.items():
        try:
            scores[name] = score(fit(pair.fitted, TWO_MASS).model, pair)
        except EstimatorError as refusal:
            sys.stderr.write(f"{name}: {refusal}\n")
            scores[name] = Score(-math.inf)
    return scores


def environment(folder: Path, peer: Peer) -> Path:
    """Return the interpreter that has a peer installed; make it where there is none."""
    home = folder / peer.name.lower()
    python = home / "bin" / "python"
    marker = home / peer.requirement
    if not marker.exists():
        venv.create(home, with_pip=True, clear=True)
        install = [str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check", peer.requirement]
        subprocess.run(install, check=True)
        marker.touch()
    return python


def theirs(pair: Pair, peer: Peer, python: Path) -> dict[str, Score]:
    """Judge every method of a peer."""
    with tempfile.TemporaryDirectory() as folder:
        source, target = Path(folder, "in.npz"), Path(folder, "out.npz")
        arrays = {"u": pair.fitted.total_torque_nm, "y": pair.fitted.output}
        arrays |= {"u_fresh": pair.fresh.total_torque_nm, "y_fresh": pair.fresh.output}
        np.savez(source, sample_time_s=np.array(pair.fitted.sample_time_s), **arrays)  # type: ignore[arg-type]
        command = [str(python), str(HERE / peer.script), str(source), str(target)]
        subprocess.run(command, check=True, timeout=TIME_LIMIT_S, stdout=subprocess.DEVNULL)
        with np.load(target) as results:
            return read(dict(results), pair)


def read(results: Mapping[str, FloatArray], pair: Pair) -> dict[str, Score]:
    """Judge what a peer's process gave back."""
    scores = {}
    for key, value in results.items():
        name, kind = key.rsplit("|", 1)
        if kind == "num":
            scores[name] = score(model_of(value, results[f"{name}|den"], pair.fitted.sample_time_s), pair)
        elif kind == "fresh":
            finite = np.isfinite(value).all()
            error = (pair.fresh.output - value)[pair.fresh.okay]
            scores[name] = Score(fit_percent(error, pair.fresh.output[pair.fresh.okay]) if finite else -math.inf)
        elif kind == "failed":
            sys.stderr.write(f"{name}: {value}\n")
            scores[name] = Score(-math.inf)
    return scores


def rows(scores: Mapping[str, Sequence[Score]]) -> list[tuple[str, ...]]:
    """Return the lines of the table, the best median free-run fit first."""
    ranked = sorted(scores.items(), key=lambda item: -median(one.fit_percent for one in item[1]))
    return [(name, *_fits(all_of), *_errors(all_of)) for name, all_of in ranked]


def _fits(scores: Sequence[Score]) -> tuple[str, str]:
    fits = [one.fit_percent for one in scores]
    return tuple(f"{value:.2f} %" if value > -100.0 else "none" for value in (median(fits), min(fits)))  # type: ignore[return-value]


def _errors(scores: Sequence[Score]) -> tuple[str, str]:
    told = []
    for errors in ([one.resonance for one in scores], [one.damping for one in scores]):
        known = [abs(error) for error in errors if not math.isnan(error)]
        missing = f", none in {len(errors) - len(known)}" if 0 < len(known) < len(errors) else ""
        told.append(
            f"{100 * math.sqrt(sum(error**2 for error in known) / len(known)):.3f} %{missing}" if known else "none"
        )
    return told[0], told[1]


def compare(runs: int, environments: Path, peers: Sequence[Peer] = PEERS) -> str:
    """Fit, judge and tell."""
    pythons = {peer: environment(environments, peer) for peer in peers}
    scores: dict[str, list[Score]] = {}
    for pair in pairs(runs):
        found = {f"this project: {name}": one for name, one in ours(pair).items()}
        for peer, python in pythons.items():
            found |= {f"{peer.name}: {name}": one for name, one in theirs(pair, peer, python).items()}
        for name, one in found.items():
            scores.setdefault(name, []).append(one)
    columns = (f"of {runs} buses", "free-run fit, median", "worst", "resonance, RMS error", "damping, RMS error")
    return table(columns, rows(scores))


def main(arguments: Sequence[str] | None = None) -> int:
    """Compare and write the table; return the exit status."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.benchmarks.peers", description="Accuracy beside other identification tools."
    )
    parser.add_argument("--environments", type=Path, required=True, metavar="DIR", help="where the peers are installed")
    parser.add_argument("--runs", type=int, default=RUNS, help="buses (default: %(default)s)")
    options = parser.parse_args(arguments)
    versions = ", ".join(peer.requirement for peer in PEERS)
    sys.stdout.write(f"{versions}\n\n{compare(options.runs, options.environments)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
