"""Real recordings lie outside the project; where they are absent their tests are skipped and say so."""

import os
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
DATA = Path(os.environ.get("HIL_DATA", ROOT.parent / "shared" / "data"))


def real_recording(name: str) -> Path:
    """Path of a real recording; skips the test where it is not there."""
    path = DATA / name
    if not path.exists():
        pytest.skip(f"real recording {name} is not in {DATA}; set HIL_DATA to the folder that holds it")
    return path


@pytest.fixture(scope="session")
def emps() -> Path:
    """The electro-mechanical positioning system of Janot, Gautier and Brunot (2019)."""
    return real_recording("emps/DATA_EMPS.mat")
