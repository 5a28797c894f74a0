"""The experiments of the rig file, driven with the PRBS that was chosen, and the resonance in them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from estimator.identification.modes.modes import Mode
from estimator.identification.online.recursive import Status as OnlineStatus
from estimator.identification.settings import Settings
from hil.commission.responses import of_repeats, record_of, rounded
from hil.commission.state import StepFinding
from hil.commission.step import Outcome, Step, StepContext
from hil.commission.steps.noise_friction import samples_lost
from hil.config.experiment_tables import ReversalTable, TipTable
from hil.errors import UsageError
from hil.orders.order import Order, as_table, cruise_of, first_of, halt

if TYPE_CHECKING:
    from estimator.identification.best import BestEstimate
    from estimator.identification.identify import Identification


RUNS = 8
"""As many as the paper evaluates together."""

SLOWEST = 0.6
"""Lowest speed, in parts of the rig file's cruise: what depends on speed then shows."""

SEED_STEP = 127
"""From run to run the shift register begins so many states further on (a prime: none comes twice in eight)."""

SPREAD = 0.02
"""Largest standard deviation of the resonance between runs, relative: what the paper's runs agree to in its figures."""

AGREEMENT = 0.02
"""On-line and batch estimate of one run agree within this, relative: DESIGN's trials gave 1 to 2.2 %."""

LEAST_FIT_PERCENT = 70.0
"""Free-run fit of a batch model: below, a third of the speed's course is not the model's."""

DRAWN_HZ = (0.5, 25.0)


def _speed_parts() -> list[float]:
    """Return the speeds of the runs, in parts of the cruise's: up and down, so that no run waits long for its speed."""
    up = np.linspace(SLOWEST, 1.0, RUNS // 2).tolist()
    return [*up, *reversed(up)]


def orders(job: StepContext) -> list[Order]:
    """Return the runs: cruises, then tip and reversal where the rig file has them, and the halt."""
    cruise = cruise_of(job.rig)
    amplitude_nm = job.evidence("prbs").get("amplitude_nm", job.rig.prbs.amplitude_nm)
    seeds = 2**job.rig.prbs.cells - 1
    runs = [
        Order(
            f"cruise{i + 1}",
            as_table(cruise, speed_rad_s=part * cruise.speed_rad_s, prbs=True),
            {"amplitude_nm": amplitude_nm, "seed": (job.rig.prbs.seed - 1 + i * SEED_STEP) % seeds + 1},
        )
        for i, part in enumerate(_speed_parts())
    ]
    for name, table in _others(job):
        if table is not None:
            runs.append(Order(name, as_table(table, prbs=True), {"amplitude_nm": amplitude_nm}, least_margin_rad_s=4.0))
    return [*runs, halt(job.rig)]


def _others(job: StepContext) -> list[tuple[str, TipTable | ReversalTable | None]]:
    """Return what is driven next to the runs at constant speed; None where the rig file has none of its kind."""
    return [("tip", first_of(job.rig, TipTable)), ("reversal", first_of(job.rig, ReversalTable))]


def _about_experiments(job: StepContext) -> str:
    amplitude_nm = job.evidence("prbs").get("amplitude_nm", job.rig.prbs.amplitude_nm)
    speed = cruise_of(job.rig).speed_rad_s
    return (
        f"drives {RUNS} runs of {cruise_of(job.rig).duration_s:g} s at {SLOWEST * speed:g} to {speed:g} rad/s with a "
        f"PRBS of ±{amplitude_nm:g} Nm, then tip-in and tip-out, then a reversal, and brings the vehicle to a stand. A "
        "run that is interrupted is driven again; those before it are kept."
    )


def _do_experiments(job: StepContext) -> Outcome:
    asked = orders(job)
    for number, order in enumerate(asked, start=1):
        job.say(f"  {number} of {len(asked)}: {order.name}")
        job.run("experiments", order)
    runs = job.runs_of("experiments")
    missing = [name for name, table in _others(job) if table is None]
    findings = [
        StepFinding("runs recorded", str(len(asked)), str(len(runs)), len(runs) == len(asked)),
        samples_lost(runs),
        *(
            StepFinding(
                name, f"an experiment of kind {name!r} in the rig file", "none", None, f"Add [experiments.{name}]"
            )
            for name in missing
        ),
    ]
    return Outcome(findings, {"recordings": {run.name: run.recording for run in runs}})


EXPERIMENTS = Step("experiments", "Experiments", _about_experiments, _do_experiments, orders, needs=("prbs",))


IdentifiedRun: TypeAlias = "tuple[Identification, BestEstimate]"
"""What one run gave."""


def cruises(job: StepContext) -> list[Any]:
    """Return the PRBS runs at constant speed."""
    runs = [run for run in job.runs_of("experiments") if run.name.startswith("cruise")]
    if len(runs) < 2:
        raise UsageError(
            f"commissioning in {job.folder}: expected PRBS runs to work with, got {len(runs)} (experiments is "
            f"{job.state.steps['experiments'].status.value}). Drive them: --repeat experiments; or skip this step."
        )
    return runs


def _settings(job: StepContext) -> Settings:
    return Settings(sample_time_s=2.0 * job.rig.period_s)


def _about_identification(job: StepContext) -> str:
    return "identifies the driveline from each PRBS run, on line and off line. Computes; commands no torque."


def _do_identification(job: StepContext) -> Outcome:
    from estimator.identification.best import best_estimate  # a second, and the bus comes first
    from estimator.identification.identify import identify as identify_record

    runs = cruises(job)
    found: list[IdentifiedRun] = []
    for i, run in enumerate(runs):
        job.progress(f"identifying {run.name}", i / len(runs))
        record, settings = record_of(job.recording(run)), _settings(job)
        found.append((identify_record(record, settings), best_estimate(record, settings.high_pass_hz)))
    job.progress("identified", 1.0)
    modes = [None if best.mode is None else best.mode.mode for _, best in found]
    evidence = {"runs": [_evidence(*each, run.name) for each, run in zip(found, runs, strict=True)]}
    return Outcome([*_resonance_findings(modes), *_quality_findings(found)], evidence)


def _resonance_findings(modes: list[Mode | None]) -> list[StepFinding]:
    known = [mode for mode in modes if mode is not None]
    look = "Look at the coherence in the report; raise the amplitude, or repeat on a better road"
    findings = [StepFinding("runs with a resonance", str(len(modes)), str(len(known)), len(known) == len(modes), look)]
    if len(known) < 2:
        return findings
    frequency = np.array([mode.frequency_hz for mode in known])
    damping = np.array([mode.damping for mode in known])
    spread = float(np.std(frequency, ddof=1) / np.mean(frequency))
    return [
        *findings,
        StepFinding(
            "resonance, mean of the runs",
            f"the same within {100.0 * SPREAD:g} % (standard deviation)",
            f"{of_repeats(frequency).shown('Hz')}; between runs {100.0 * spread:.2f} %",
            spread <= SPREAD,
            "See whether it depends on speed or time; the diagnosis looks for the cause",
        ),
        StepFinding("damping, mean of the runs", "–", of_repeats(damping).shown(), None),
    ]


def _quality_findings(found: list[IdentifiedRun]) -> list[StepFinding]:
    from estimator.identification.best import ModelVerdict

    pairs = [(each.online_resonance, best.mode) for each, best in found]
    both = [(a.frequency_hz, b.frequency_hz.value) for a, b in pairs if a is not None and b is not None]
    worst = max((abs(a / b - 1.0) for a, b in both), default=float("nan"))
    estimated = sum(each.estimate.status is OnlineStatus.ESTIMATED for each, _ in found)
    fits = [best.fit.fit_percent for _, best in found]
    good = sum(best.verdict in (ModelVerdict.GOOD, ModelVerdict.CLOSED_LOOP) for _, best in found)
    return [
        StepFinding(
            "on line against off line, resonance",
            f"within {100.0 * AGREEMENT:g} % in every run",
            f"{100.0 * worst:.2f} % at worst" if both else "nothing to compare",
            bool(both) and len(both) == len(found) and worst <= AGREEMENT,
            "The on-line estimate needs more excitation, or longer runs",
        ),
        StepFinding("runs whose on-line estimate stands", str(len(found)), str(estimated), estimated == len(found)),
        StepFinding(
            "runs a linear model is enough for",
            str(len(found)),
            str(good),
            good == len(found),
            "The drive is not linear, or has more than two masses: see the diagnosis",
        ),
        StepFinding(
            "free-run fit of the off-line models",
            f"at least {LEAST_FIT_PERCENT:g} %",
            f"{min(fits):.1f} to {max(fits):.1f} %",
            min(fits) >= LEAST_FIT_PERCENT,
            "A linear model does not explain everything: see the diagnosis",
        ),
    ]


def _evidence(found: Identification, best: BestEstimate, run: str) -> dict[str, Any]:
    frequency = np.geomspace(*DRAWN_HZ, 160)
    frequency = frequency[frequency < 0.5 / found.data.sample_time_s]
    spectral = found.spectral
    return {
        "run": run,
        "best": _model(best.fit.model, None if best.mode is None else best.mode.mode) | {"verdict": best.verdict.value},
        "batch": _model(found.batch.model, found.batch_resonance) | {"fit_percent": found.batch.fit_percent},
        "online": _model(found.online, found.online_resonance) | {"status": found.estimate.status.value},
        "frequency_hz": rounded(frequency),
        "magnitude": rounded(np.abs(best.fit.model.response(frequency))),
        "spectral": None
        if spectral is None
        else {
            "frequency_hz": rounded(spectral.frequency_hz),
            "magnitude": rounded(np.abs(spectral.response)),
            "coherence": rounded(spectral.coherence),
        },
    }


def _model(model: Any, mode: Mode | None) -> dict[str, Any]:
    return {
        "theta": model.theta.tolist(),
        "nk": model.nk,
        "sample_time_s": model.sample_time_s,
        "poles": [[float(z.real), float(z.imag)] for z in model.poles],
        "zeros": [[float(z.real), float(z.imag)] for z in model.zeros],
        "resonance": None if mode is None else [mode.frequency_hz, mode.damping],
    }


IDENTIFICATION = Step(
    "identification", "Identification", _about_identification, _do_identification, needs=("experiments",)
)
