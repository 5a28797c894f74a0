"""Every recursive estimator by name, so that they can be compared on the same data.

A new one is a class with the interface of :class:`RecursiveEstimator` and one row here; the contract test then runs
over it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from types import MappingProxyType

import numpy as np

from estimator.errors import BadModel
from estimator.identification.linear_model import Orders
from estimator.identification.online.adaptation import Adaptation, DecreasingThenConstantTrace
from estimator.identification.online.ekf import Ekf, EkfNoise, TwoMass
from estimator.identification.online.oefo import Filtering, Oefo
from estimator.identification.online.recursive import RecursiveEstimator
from estimator.identification.online.rls_riv_oeepm import OeEpm, Riv, Rls
from estimator.signals.record import FloatArray


class Feed(Enum):
    """Which samples an estimator is made for."""

    FILTERED = "filtered"  # high-passed and decimated to the models' period
    RAW = "raw"  # as they were recorded, at their own period


@dataclass(frozen=True, slots=True, eq=False)
class Setup:
    """What estimators are made from; each takes what it needs."""

    orders: Orders = field(default_factory=Orders)  # structure of the transfer functions
    sample_time_s: float = 0.02  # period of the samples that will come [s]
    adaptation: Adaptation = field(default_factory=DecreasingThenConstantTrace)  # adaptation-gain profile
    L: FloatArray | None = None  # observation filter's denominator, from a batch model
    start_up_samples: int = 0  # good samples at the start without the filter
    two_mass: TwoMass | None = None  # start values of the physical parameters
    noise: EkfNoise = field(default_factory=EkfNoise)  # for the Kalman filter


@dataclass(frozen=True, slots=True)
class Entry:
    """An estimator that can be asked for by name."""

    title: str  # what it is, for a reader
    make: Callable[[Setup], RecursiveEstimator]  # makes one, ready for samples
    feed: Feed = Feed.FILTERED  # the samples it is made for

    def __call__(self, setup: Setup) -> RecursiveEstimator:
        """Make one, ready for samples."""
        return self.make(setup)


def _oefo(setup: Setup) -> Oefo:
    filtering = Filtering.ADAPTED if setup.L is None else Filtering.FIXED
    L = np.ones(1) if setup.L is None else setup.L
    return Oefo(L, setup.orders, setup.adaptation, filtering, setup.start_up_samples)


def _riv(setup: Setup) -> Riv:
    L = np.ones(1) if setup.L is None else setup.L
    return Riv(L, setup.orders, setup.adaptation, setup.start_up_samples)


def _ekf(setup: Setup) -> Ekf:
    if setup.two_mass is None:
        raise BadModel(
            "ekf: no start values for J_M, J_L, k and c, expected a two-mass model. Give a model file with them; "
            "a factor of two off is near enough."
        )
    return Ekf(setup.two_mass, setup.sample_time_s, setup.orders.nk, setup.noise)


ESTIMATORS: Mapping[str, Entry] = MappingProxyType(
    {
        "oefo": Entry("recursive output error with filtered observations", _oefo),
        "rls": Entry("recursive least squares", lambda setup: Rls(setup.orders, setup.adaptation)),
        "riv": Entry("recursive instrumental variable with auxiliary model", _riv),
        "oeepm": Entry(
            "recursive output error with extended prediction model", lambda setup: OeEpm(setup.orders, setup.adaptation)
        ),
        "ekf": Entry("extended Kalman filter with the two-mass parameters", _ekf, Feed.RAW),
    }
)
"""Every recursive estimator; the paper's first."""
