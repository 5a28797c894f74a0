"""``hil effects new``: a law of one's own from a table, which the simulation takes like the table itself."""

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from estimator.physics.driveline import InitialCondition
from estimator.physics.layout import Grid, flat
from estimator.physics.simulate import simulate
from hil.cli.effects import app
from hil.config.model_file import read_model
from hil.errors import ModelFileError, UsageError
from tests.estimator.physics.bench import random_steps, record

LINE = """
schema = "hil.model/1"
structure = "two_mass"
[parameters]
J_M = { value = 1.6, tolerance = 0.2 }
J_L = { value = 40.0, tolerance = 0.2 }
k = { value = 4200, tolerance = 0.2 }
c = { value = 9.0, tolerance = 0.2 }
b_M = { value = 0.35, tolerance = 0.2 }
b_L = { value = 0.9, tolerance = 0.2 }
"""
TABLE = """
[tables.motor_speed]
knots = [-4.0, -1.0, 0.0, 1.0, 4.0]
values = [-9.0, -7.0, 0.0, 7.0, 9.0]
"""


def test_the_law_does_what_the_table_does(tmp_path: Path) -> None:
    source = tmp_path / "augmented.toml"
    source.write_text(LINE + TABLE)
    done = CliRunner().invoke(app, ["new", "--from", str(source), "--name", "rubbing", "--out", str(tmp_path)])
    assert done.exit_code == 0, done.output
    assert "TODO" in (tmp_path / "rubbing.py").read_text()
    model = tmp_path / "next.toml"
    model.write_text(LINE + (tmp_path / "rubbing.toml").read_text() + "[effects.rubbing]\nsize = { value = 1.0 }\n")
    rec, start = record(random_steps(120, seed=7), np.ones(120)), InitialCondition(2.0, 0.0, 1.0, 0.0, 1.0)
    runs = []
    for each in (read_model(source).model, read_model(model, trust_laws=True).model):
        runs.append(simulate(Grid(each.structure, 6, 0.02, each.laws), rec, flat(each), start))
    np.testing.assert_allclose(runs[1], runs[0], atol=1e-6)


@pytest.mark.parametrize(
    ("text", "arguments", "error"),
    [
        (LINE, ["--name", "rubbing"], ModelFileError),
        (LINE + TABLE, ["--name", "no name"], UsageError),
        (LINE + TABLE, ["--table", "torque"], UsageError),
    ],
)
def test_what_makes_no_law_is_refused_and_nothing_is_written(
    tmp_path: Path, text: str, arguments: list[str], error: type[Exception]
) -> None:
    source, out = tmp_path / "augmented.toml", tmp_path / "laws"
    source.write_text(text)
    done = CliRunner().invoke(app, ["new", "--from", str(source), "--out", str(out), *arguments])
    assert isinstance(done.exception, error)
    assert not out.exists()
