"""Two noisy recordings of a line of two masses with one effect: fitted from the line without it, and decided."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimator.diagnosis.acquisition.chain import with_faults_compensated
from estimator.diagnosis.inference.decide import Decision, Rival, decide, no_rival
from estimator.diagnosis.inference.figures import Unseen
from estimator.diagnosis.inference.fits import Fits
from estimator.diagnosis.inference.hypotheses import all_good_samples, open_hypotheses
from estimator.diagnosis.inference.search import Search, search_from_nothing
from estimator.diagnosis.result import Diagnosis, Effort
from estimator.diagnosis.say import Basis, said
from estimator.diagnosis.tables import unnamed_law
from estimator.physics.driveline import InitialCondition
from estimator.physics.layout import flat_values, grid_for
from estimator.physics.model import DrivelineModel
from estimator.physics.simulate import simulate
from estimator.signals.record import BoolArray, FloatArray, Record
from tests.estimator.diagnosis.planted import SIGMA, drive_torque
from tests.estimator.physics.bench import TWO_MASS, model, record

SEEDS = (3, 4)
DRIVES = tuple(drive_torque(seed) for seed in SEEDS)


@dataclass(frozen=True)
class Bench:
    """A nominal model, recordings, and which of their samples count."""

    model: DrivelineModel
    records: Sequence[Record]

    @property
    def use(self) -> list[BoolArray]:
        """Every good sample."""
        return all_good_samples(self.records)


def bench_with(name: str, values: Mapping[str, float], torques_nm: Sequence[FloatArray] = DRIVES) -> Bench:
    """Simulate the line under two torques, with an effect of these parameters."""
    line, true, records = model(TWO_MASS), flat_values(TWO_MASS, {name: values}), []
    for seed, torque_nm in zip(SEEDS, torques_nm, strict=True):
        silent = record(torque_nm, np.zeros(torque_nm.size), name=f"run_{seed}")
        output = simulate(grid_for(line, [silent]), silent, true, InitialCondition(5.0, 0.0, 2.0))
        noise = SIGMA * np.random.default_rng(seed).standard_normal(output.size)
        records.append(replace(silent, output=output + noise))
    return Bench(line, records)


def searched(bench: Bench, names: Sequence[str] = ()) -> Search:
    """Search some effects, or all that the recordings can tell."""
    records = list(bench.records)
    names = names or open_hypotheses(bench.model, records)[0]
    return search_from_nothing(Fits(bench.model, records, all_good_samples(records), names))


def decided(search: Search, unseen: Sequence[Record] = (), rival: Rival = no_rival) -> Decision:
    """Decide on what was found; ``unseen`` are recordings that no fit has seen."""
    fits = search.fits
    chain, never_fitted = with_faults_compensated(fits.records), with_faults_compensated(unseen)
    return decide(search, chain, Unseen(fits.model, never_fitted), rival)


def diagnosed(search: Search, decision: Decision) -> Diagnosis:
    """Return what is said of a decision."""
    return said(Basis(decision, search, search.fits.model, Effort(), law=unnamed_law(decision)))
