"""A shaft that cracks, and a fit of it expressed the other way round."""

from dataclasses import replace

import numpy as np

from estimator.physics.driveline import InitialCondition
from estimator.physics.fit import FitResult, fit
from estimator.physics.layout import flat, grid_for, slot
from estimator.physics.model import DrivelineModel
from estimator.physics.problem import make_problem
from estimator.physics.simulate import simulate
from estimator.physics.unknowns import Shared, effect_unknowns, nominal_unknowns
from estimator.signals.record import Record
from tests.estimator.physics.bench import TWO_MASS, model, random_steps, record

CRACK, SIGMA, SAMPLES = "stiffness_change", 0.02, 900
LAST_S = (SAMPLES - 1) * 0.01
CHANGE, AT_S = -0.2, 4.0
SOUND = model(TWO_MASS, tolerance=0.5)


def cracking(seed: int, from_s: float, to_s: float) -> Record:
    """A shaft that is softer for a while; simulated by the law that is fitted, what is tested is how it is reported."""
    line = model(TWO_MASS, effects={CRACK: {"change": CHANGE}})
    torque = random_steps(SAMPLES, seed, mean_nm=30.0)
    blank = record(torque, np.ones(SAMPLES), name=f"run_{seed}")
    p = flat(line)
    p[slot(CRACK, "from_s")], p[slot(CRACK, "to_s")] = from_s, to_s
    clean = simulate(grid_for(line, [blank]), blank, p, InitialCondition(10.0, 0.0, 20.0, 0.005, 20.0))
    return replace(blank, output=clean + SIGMA * np.random.default_rng(seed).standard_normal(SAMPLES))


def the_other_way_round(line: DrivelineModel, records: list[Record], moments: list[tuple[float, float]]) -> FitResult:
    """Fit from a shaft that is nominally soft, and stiffer until the moment."""
    release = effect_unknowns(CRACK, line, records)[0]
    starts = {"k": 1.0 + CHANGE, "change": 1.0 / (1.0 + CHANGE) - 1.0}

    def begun(unknown: Shared) -> Shared:
        return replace(unknown, start=starts.get(unknown.name, unknown.start))

    own = [
        tuple(
            replace(
                u,
                start=at,
                low=max(u.low, at - 0.3) if ends > begins else at,
                high=min(u.high, at + 0.3) if ends > begins else at,
            )
            for u, at in zip(unknowns, (begins, ends), strict=True)
        )
        for unknowns, (begins, ends) in zip(release.own, moments, strict=True)
    ]
    shared = tuple(begun(unknown) for unknown in (*nominal_unknowns(line), *release.shared))
    return fit(make_problem(line, records, shared, own=own))
