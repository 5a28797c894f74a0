import pytest

from estimator.identification.identify import Identification, identify
from tests.estimator.identification.driveline import Cruise, cruise


@pytest.fixture(scope="session")
def cruises() -> list[Cruise]:
    """Eight drives, as many as the paper has."""
    return [cruise(seed, name=f"cruise_{seed}") for seed in range(8)]


@pytest.fixture(scope="session")
def identified(cruises: list[Cruise]) -> list[Identification]:
    return [identify(drive.record) for drive in cruises]
