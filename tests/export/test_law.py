"""A law without a name as Structured Text: executed it is the curve of the simulation."""

from pathlib import Path

import numpy as np
import pytest

from estimator.physics.curve import curve_over
from estimator.physics.layout import flat, slot
from hil.cli.main import run
from hil.config.model_file import read_model
from tests.cli.test_effects_new import LINE
from tests.export.iec.machine import Machine

LAW = """
[tables.shaft_twist]
knots = [-0.04, -0.02, 0.0, 0.02, 0.05]
values = [-120.0, -40.0, 0.0, 41.5, 121.0]
"""
AT_ANGLE = """
[tables.load_angle]
knots = [0.0, 1.0, 2.0, 3.0]
values = [0.0, 1.0, -1.0, 0.0]
"""


def written(tmp_path: Path, more: str, *options: str) -> tuple[int, Path]:
    (tmp_path / "augmented.toml").write_text(LINE + more)
    out = tmp_path / "law.st"
    return run(["export", "law", str(tmp_path / "augmented.toml"), "--out", str(out), *options]), out


def test_the_curve_is_that_of_the_simulation(tmp_path: Path) -> None:
    status, out = written(tmp_path, LAW)
    assert status == 0
    law = Machine(out.read_text("ascii"), "FB_HilLaw", tmp_path)
    x = np.concatenate([np.linspace(-0.06, 0.07, 1301), [-0.04, -0.02, 0.0, 0.02, 0.05]])
    p = flat(read_model(tmp_path / "augmented.toml").model)
    expected = curve_over(x, p, slot("table_shaft_twist", "knots"))
    np.testing.assert_allclose([law(x=each).value for each in x], expected, rtol=1e-12, atol=1e-10)
    assert np.isnan(law(x=float("nan")).value)


@pytest.mark.parametrize(
    ("more", "options", "said"),
    [
        ("", (), "expected a law without a name"),
        (AT_ANGLE, (), "expected a law that does not repeat itself"),
        (LAW, ("--table", "torque"), "--table: expected one of shaft_twist"),
    ],
)
def test_without_a_law_that_can_be_written_nothing_is(
    more: str, options: tuple[str, ...], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    status, out = written(tmp_path, more, *options)
    assert status == 2
    assert said in capsys.readouterr().err
    assert not out.exists()
