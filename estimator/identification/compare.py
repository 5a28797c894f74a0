"""Several recursive estimators on the same data, so that a choice of one can be judged."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from estimator.identification.excitation import SAMPLES_PER_PARAMETER
from estimator.identification.identify import Identification
from estimator.identification.modes.modes import Mode, resonance
from estimator.identification.offline.free_run import free_run
from estimator.identification.offline.noise_model import white
from estimator.identification.online.recursive import Status
from estimator.identification.online.registry import Entry, Feed, Setup
from estimator.identification.online.two_mass import TwoMass
from estimator.identification.settings import Settings
from estimator.signals.decimate import decimate
from estimator.signals.record import Record


@dataclass(frozen=True, slots=True)
class Compared:
    """What one estimator made of one recording.

    Attributes
    ----------
    recording, estimator : str
        Names.
    resonance : Mode or None
        Of its last model.
    fit_percent : float
        Free-run fit of that model over the whole recording, high-passed, at the model's period; NaN where unstable.
    status : Status
        Of its last estimate.
    reason : str
        Why it has that status and what to do; empty where nothing is wrong.
    """

    recording: str
    estimator: str
    resonance: Mode | None
    fit_percent: float
    status: Status
    reason: str = ""


def compare(
    record: Record, found: Identification, settings: Settings, name: str, entry: Entry, start: TwoMass | None = None
) -> Compared:
    """Run an estimator through the stretch of time the recursive estimate of an identification was made from.

    Parameters
    ----------
    record : Record
        As recorded.
    found : Identification
        Of it, with the settings; its L is used where one is asked for.
    settings : Settings
        It was identified with.
    name : str
        Of the estimator.
    entry : Entry
        What makes it.
    start : TwoMass, optional
        Start values of the physical parameters.

    Raises
    ------
    BadModel
        If the estimator needs start values and there are none.
    """
    raw = entry.feed is Feed.RAW
    fed = record if raw else found.data
    n = len(found.trajectory) * (settings.factor(record) if raw else 1)
    setup = Setup(
        orders=settings.orders,
        sample_time_s=fed.sample_time_s,
        adaptation=settings.adaptation,
        L=found.L,
        start_up_samples=SAMPLES_PER_PARAMETER * settings.orders.n_parameters,
        two_mass=start,
    )
    estimator = entry(setup)
    trajectory = estimator.run(fed.total_torque_nm[:n], fed.output[:n], fed.okay[:n])
    model = estimator.model(fed.sample_time_s)
    judged = decimate(record, 1, settings.high_pass_hz) if raw else found.data
    fit = free_run(model, judged, white(judged.output, judged.okay)).fit_percent if model.is_stable else float(np.nan)
    last = trajectory[len(trajectory) - 1]
    return Compared(found.name, name, resonance(model, settings.band_hz), fit, last.status, last.reason.message)
