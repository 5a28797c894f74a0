import pytest

from estimator.identification.identify import Identification, identify
from estimator.identification.linear_model import Orders
from estimator.identification.offline.fits import LinearFit, fit_box_jenkins
from estimator.signals.decimate import decimate
from estimator.signals.record import Record
from tests.estimator.identification.driveline import Cruise, cruise


@pytest.fixture(scope="session")
def cruises() -> list[Cruise]:
    """Eight drives, as many as the paper has."""
    return [cruise(seed, name=f"cruise_{seed}") for seed in range(8)]


@pytest.fixture(scope="session")
def identified(cruises: list[Cruise]) -> list[Identification]:
    return [identify(drive.record) for drive in cruises]


@pytest.fixture(scope="session")
def records() -> list[Record]:
    """Six cruises at their own period."""
    return [decimate(cruise(seed, 20.0, name=f"run_{seed}").record, 1) for seed in range(300, 306)]


@pytest.fixture(scope="session")
def fits(records: list[Record]) -> list[LinearFit]:
    """Their Box-Jenkins models of third order, which take seconds each."""
    return [fit_box_jenkins(record, Orders(3, 3, 1)) for record in records]
