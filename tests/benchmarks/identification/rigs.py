"""How right the identified models are on the drivelines of the tests and of the proof: no driver holds the speed there.

``accuracy``  eight cruises, as many as the paper has: resonance and damping on line (N = 1024, Ts = 20 ms) and off line
              against the truth; frequency responses against each other around the resonance
``coverage``  how often the 95 % intervals of the best estimate hold the truth: resonance, damping, physical parameters
``truth``     the same on the independent truth simulator: every run another bus, other inverters, another road
``paper``     coverage on the rig of ``hil paper``: both protocol stacks, a driver, a road, a payload; 30 s each
"""

import tempfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from estimator.errors import BadModel
from estimator.identification.best import best_estimate
from estimator.identification.identify import VALUES_PER_WIDTH, identify
from estimator.identification.linear_model import LinearModel, Orders
from estimator.identification.modes.modes import Mode, Uncertain, two_mass_resonance
from estimator.identification.modes.physical import physical_parameters
from estimator.identification.offline.fits import fit_box_jenkins
from estimator.identification.spectral import SpectralEstimate, spectral_estimate
from estimator.signals.decimate import decimate
from estimator.signals.record import Record
from hil.figures.road import draw_conditions, drive as drive_paper
from hil.proof.truth.bus import NOMINAL_ERROR
from hil.proof.truth.case import record as drive
from hil.proof.truth.specimen import draw_specimen
from hil.recording.signals import read_record
from hil.rig.stop import StopRequest
from tests.benchmarks.identification.scores import Rate
from tests.benchmarks.ratios import table
from tests.estimator.identification import driveline
from tests.estimator.identification.driveline import cruise, uncertain_resonance

EXPERIMENTS = 8

FIRST_SEED = 10_000
"""Far from the seeds of the tests, on which settings were chosen."""

RESONANCE_LIMIT, DAMPING_LIMIT, RESPONSE_LIMIT_DB = 0.02, 0.15, 1.0
COVERAGE_LIMITS = (0.90, 0.98)

TWO_MASS = Orders(3, 3, 1)

AROUND = (0.75, 1.33)
"""The band around the resonance, in parts of its frequency."""

COHERENT = 0.9

PAPER_S = 30.0
"""Length of an experiment on the rig of ``hil paper`` [s]."""


@dataclass(frozen=True, slots=True)
class Truth:
    """A recording and what it was made of; ``parameters`` holds J_M, J_L, k and c + b_M."""

    record: Record
    mode: Mode
    parameters: Mapping[str, float]


def _parameters(J_M: float, J_L: float, k: float, c: float, b_M: float) -> dict[str, float]:
    return {"J_M": J_M, "J_L": J_L, "k": k, "c + b_M": c + b_M}


def cruises(runs: int) -> Iterator[Truth]:
    """Yield cruises of the tests' driveline, 22 s each."""
    values = _parameters(driveline.J_M, driveline.J_L, driveline.K, driveline.C, driveline.B_M)
    for seed in range(FIRST_SEED, FIRST_SEED + runs):
        one = cruise(seed)
        yield Truth(one.record, Mode(one.resonance_hz, one.damping), values)


def buses(runs: int) -> Iterator[Truth]:
    """Yield cruises of the truth simulator, 30 s each, nothing hidden; no two of one bus."""
    for seed in range(FIRST_SEED, FIRST_SEED + runs):
        specimen = draw_specimen("none", seed, NOMINAL_ERROR)
        driven, bus = drive(specimen, 0), specimen.bus
        mode = two_mass_resonance(bus.J_M, bus.J_L, bus.k, bus.c, bus.b_M, bus.b_L)
        if mode is None:
            raise ValueError(f"bus {seed} does not oscillate; expected one that does")
        torque_nm = np.column_stack([driven.torque_m1_nm, driven.torque_m2_nm])
        okay = np.isfinite(driven.speed_rad_s)
        record = Record(f"bus_{seed}", 0.01, driven.time_s, torque_nm, driven.speed_rad_s, okay)
        yield Truth(record, mode, _parameters(bus.J_M, bus.J_L, bus.k, bus.c, bus.b_M))


def paper_rig(runs: int) -> Iterator[Truth]:
    """Yield experiments of ``hil paper``, each on a bus and road of its own."""
    with tempfile.TemporaryDirectory() as folder:
        for number, conditions in enumerate(draw_conditions(FIRST_SEED, runs)):
            driven = drive_paper(Path(folder) / f"run_{number}.csv", conditions, PAPER_S, StopRequest())
            line, mode = driven.line, driven.line.resonance
            if mode is None:
                raise ValueError(f"the bus of experiment {number} does not oscillate; expected one that does")
            parameters = _parameters(line.J_M, line.J_L, line.k, line.c, line.b_M)
            yield Truth(read_record(driven.path), mode, parameters)


def estimates(truth: Truth) -> dict[str, tuple[Uncertain, float]]:
    """Return each number of the best estimate with its true value, by name."""
    best = best_estimate(truth.record)
    mode, fit = best.mode, best.two_mass
    if mode is None:
        nowhere = Uncertain(float("nan"), float("nan"))
        return {"resonance": (nowhere, truth.mode.frequency_hz), "damping": (nowhere, truth.mode.damping)}
    modal = {"resonance": (mode.frequency_hz, truth.mode.frequency_hz), "damping": (mode.damping, truth.mode.damping)}
    try:
        found = physical_parameters(fit.model, fit.covariance)
    except BadModel:  # refused, and not counted: no interval is printed then
        return modal
    both = {**found.parameters, **found.sums}
    return modal | {name: (both[name].estimate, value) for name, value in truth.parameters.items()}


def coverage(truths: Iterator[Truth]) -> dict[str, tuple[Rate, float, float]]:
    """Return for each estimate how often its interval held the truth, its RMS error and its median stated deviation."""
    found = [estimates(truth) for truth in truths]
    rates = {}
    for name in dict.fromkeys(name for one in found for name in one):
        pairs = [one[name] for one in found if name in one]
        held = sum(estimate.covers(value) for estimate, value in pairs)
        error = np.sqrt(np.nanmean([(estimate.value / value - 1.0) ** 2 for estimate, value in pairs]))
        said = np.nanmedian([estimate.std / value for estimate, value in pairs])
        rates[name] = (Rate(held, len(pairs)), float(error), float(said))
    return rates


def coverage_table(runs: int, source: Callable[[int], Iterator[Truth]]) -> str:
    """Tell how often the intervals hold the truth."""
    low, high = COVERAGE_LIMITS
    rows = [
        (name, rate.text, f"{100 * error:.3g} %", f"{100 * said:.3g} %")
        for name, (rate, error, said) in coverage(source(runs)).items()
    ]
    columns = (f"of {runs} runs", f"held the truth, {low:.0%} to {high:.0%}", "RMS error", "stated std, median")
    return table(columns, rows)


def worst_db(model: LinearModel, other: SpectralEstimate, mode: Mode) -> float:
    """Return the largest difference of magnitude [dB] around a resonance where the coherence is high."""
    low, high = (part * mode.frequency_hz for part in AROUND)
    band = (other.frequency_hz > low) & (other.frequency_hz < high) & (other.coherence > COHERENT)
    ratio = np.abs(model.response(other.frequency_hz[band])) / np.abs(other.response[band])
    return float(np.abs(20.0 * np.log10(ratio)).max()) if band.any() else float("nan")


@dataclass(frozen=True, slots=True)
class Experiment:
    """Relative errors of one run, on line and off line, and the responses against each other [dB]."""

    name: str
    online: tuple[float, float]
    offline: tuple[float, float]
    response_db: float

    @property
    def is_good(self) -> bool:
        """Tell whether the on-line estimate and the responses are within the limits."""
        resonance, damping = (abs(error) for error in self.online)
        return resonance < RESONANCE_LIMIT and damping < DAMPING_LIMIT and self.response_db < RESPONSE_LIMIT_DB


def experiment(truth: Truth) -> Experiment:
    """Identify one run as the paper does, and off line."""
    result = identify(truth.record)
    offline = fit_box_jenkins(decimate(truth.record, 1), TWO_MASS)
    mode = uncertain_resonance(offline.model, offline.covariance)
    return Experiment(
        truth.record.name,
        _errors(result.online_resonance, truth.mode),
        _errors(None if mode is None else mode.mode, truth.mode),
        worst_db(result.online, spectral_estimate(result.data, VALUES_PER_WIDTH), truth.mode),
    )


def _errors(mode: Mode | None, truth: Mode) -> tuple[float, float]:
    if mode is None:
        return float("inf"), float("inf")
    return mode.frequency_hz / truth.frequency_hz - 1.0, mode.damping / truth.damping - 1.0


def accuracy(source: Callable[[int], Iterator[Truth]] = cruises) -> str:
    """Tell the errors of eight experiments."""
    rows = []
    for truth in source(EXPERIMENTS):
        one = experiment(truth)
        errors = [f"{100 * error:+.2f} %" for error in (*one.online, *one.offline)]
        rows.append(
            (f"{truth.mode.frequency_hz:.2f} Hz", *errors, f"{one.response_db:.2f} dB", "yes" if one.is_good else "no")
        )
    columns = (
        "truth",
        f"on line: resonance, at most {RESONANCE_LIMIT:.0%}",
        f"damping, at most {DAMPING_LIMIT:.0%}",
        "off line: resonance",
        "damping",
        f"responses apart, at most {RESPONSE_LIMIT_DB:g} dB",
        "kept",
    )
    return table(columns, rows)


def truth_part(runs: int) -> str:
    """Both comparisons on the truth simulator's buses."""
    return f"{accuracy(buses)}\n{coverage_table(runs, buses)}"
