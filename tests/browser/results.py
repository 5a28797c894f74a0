"""One result for each kind of page, made once: pages are judged, not results."""

from functools import cache
from typing import Any

import numpy as np

from estimator.identification.identify import Compared, Study, compare, identify, study
from estimator.identification.online.estimators import ESTIMATORS
from estimator.identification.settings import Settings
from estimator.physics.driveline import InitialCondition
from estimator.physics.free_run import FreeRun
from estimator.physics.model import Motion
from estimator.signals.record import Record
from hil.figures.local_model import LocalModel, Reference, TwoMassLine, row_of
from hil.figures.road import draw_conditions
from hil.report.comparison import Comparison, compare_record
from tests.estimator.identification.driveline import B_L, B_M, J_L, J_M, C, K, cruise

TRUTH = TwoMassLine(J_M, J_L, K, C, B_M, B_L)


@cache
def identified() -> tuple[list[LocalModel], list[Study], None, list[Compared]]:
    """Arguments of an identification's page."""
    settings, record = Settings(), cruise(1, name="run_1").record
    found = identify(record, settings)
    compared = [compare(record, found, settings, "rls", ESTIMATORS["rls"])]
    return [LocalModel(record, found, Reference("truth", TRUTH))], [study(record, found, settings)], None, compared


@cache
def paper_results() -> tuple[Any, ...]:
    """Arguments of the paper's page."""
    records = [cruise(seed, name=f"run_{seed}").record for seed in (1, 2)]
    models = [LocalModel(record, identify(record), Reference("truth", TRUTH)) for record in records]
    return models, [row_of(model) for model in models], draw_conditions(1, len(models))


class Smoothed:
    """A plant whose simulation is the recording itself, smoothed: nothing has to be compiled for it."""

    motion = Motion.ROTATION

    def __init__(self, name: str, samples: int) -> None:
        self.name, self._samples = name, samples

    def run(self, record: Record) -> FreeRun:
        output = np.convolve(record.output, np.full(self._samples, 1.0 / self._samples), mode="same")
        start = InitialCondition(load_torque_nm=58.0, angle_rad=0.0, speed_rad_s=float(output[0]))
        return FreeRun(output, float(np.std(record.output - output)), start)


@cache
def comparisons() -> list[list[Comparison]]:
    """Arguments of a comparison's page: two models and two recordings."""
    plants = [Smoothed("good.toml", 3), Smoothed("poor.toml", 30)]
    records = [cruise(seed, name=f"run_{seed}").record for seed in (1, 2)]
    return [[compare_record(each, record) for each in plants] for record in records]
