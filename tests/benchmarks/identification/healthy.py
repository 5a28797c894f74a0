"""Ten healthy recordings: the model identified from each must pass its own residual test."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from types import MappingProxyType

from estimator.identification.linear_model import Orders
from estimator.identification.offline.fits import LinearFit, fit_box_jenkins, fit_output_error
from estimator.identification.offline.validation import validate
from estimator.identification.settings import Settings
from estimator.signals.decimate import decimate
from estimator.signals.record import Record
from tests.benchmarks.buses.bus import draw_bus
from tests.benchmarks.buses.drive import CLEAN, ON_THE_ROAD, World, drive
from tests.benchmarks.ratios import table

FIRST_SEED, COUNT = 5000, 10

Fit = Callable[[Record], tuple[LinearFit, Record]]


def recordings(world: World = CLEAN) -> Iterator[Record]:
    """Yield ten recordings of 30 s in which nothing is wrong, each of another bus."""
    for seed in range(FIRST_SEED, FIRST_SEED + COUNT):
        yield drive(draw_bus(seed), world=world)


def at_10_ms(record: Record) -> tuple[LinearFit, Record]:
    """Return the model at the recording's own period and the data it is of."""
    data = decimate(record, 1)
    return fit_box_jenkins(data, Orders(3, 3, 1)), data


def at_20_ms(record: Record) -> tuple[LinearFit, Record]:
    """Return the model at the paper's period and the data it is of."""
    data = decimate(record, Settings().factor(record))
    return fit_output_error(data), data


FITS: Mapping[str, Fit] = MappingProxyType({"Box-Jenkins, 10 ms": at_10_ms, "output error, 20 ms": at_20_ms})


def passed(world: World, fit: Fit) -> int:
    """Return how many of the ten models leave a residual that is independent of the past input."""
    fitted = (fit(record) for record in recordings(world))
    return sum(validate(model, data).independence.is_independent for model, data in fitted)


def healthy_table() -> str:
    """Tell how many pass."""
    worlds = {"clean": CLEAN, "on the road": ON_THE_ROAD}
    rows = [(name, *(f"{passed(world, fit)} of {COUNT}" for world in worlds.values())) for name, fit in FITS.items()]
    return table(("residual independent of the past torque", *worlds), rows)
