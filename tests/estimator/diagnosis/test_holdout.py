"""Hold-out: the blocks that are kept out, and foreign recordings with a fit's parameters."""

from __future__ import annotations

import numpy as np
import pytest

from estimator.diagnosis.inference.figures import BLOCK_S, EVERY_S, blocks, foreign_outputs
from estimator.diagnosis.inference.hypotheses import NOTHING, Effects, everything
from estimator.physics.driveline import Start
from estimator.physics.effects.load import KNOT_SPACING_S
from estimator.physics.fit import FitResult
from estimator.signals.record import Record
from tests.estimator.diagnosis.plain import Bench
from tests.estimator.diagnosis.planted import SIGMA, drive_torque, rubbing
from tests.estimator.physics.bench import ONE_MASS, linear_record, model, record

COULOMB: Effects = frozenset({"coulomb_friction_motor"})
LINE = model(ONE_MASS)
SAMPLES = 1200


def with_friction(seeds: tuple[int, ...] = (1, 2)) -> list[Record]:
    return rubbing(lambda speed: 12.0, seeds, SAMPLES)


def fits(records: list[Record], effects: Effects) -> tuple[FitResult, FitResult]:
    bench = Bench(LINE, records, everything(records))
    return bench.fit(NOTHING), bench.fit(effects, bench.fit(NOTHING))


class TestBlocks:
    def test_they_are_kept_out_all_along_and_not_at_the_ends(self) -> None:
        out = blocks(record(np.zeros(2000), np.zeros(2000)))
        assert out.mean() == pytest.approx(BLOCK_S / EVERY_S, abs=0.01)
        assert not out[:50].any()
        assert not out[-50:].any()
        short = blocks(record(np.zeros(100), np.zeros(100)))
        assert short.mean() == pytest.approx(BLOCK_S / EVERY_S, abs=0.05)
        assert BLOCK_S < KNOT_SPACING_S  # so that the profile on both sides can predict it


def test_foreign_recordings_get_their_own_load_and_start_and_nothing_else() -> None:
    records = with_friction()
    _, fitted = fits(records, COULOMB)
    torque = drive_torque(11, SAMPLES)
    elsewhere = linear_record(ONE_MASS, torque, Start(8.0, 0.0, -4.0), sigma=SIGMA, name="elsewhere")
    (output,) = foreign_outputs(fitted, LINE, [elsewhere], [elsewhere.okay], COULOMB)
    (again,) = foreign_outputs(fitted, model(ONE_MASS, 0.9), [elsewhere], [elsewhere.okay], COULOMB)
    np.testing.assert_array_equal(output, again)
    assert np.std(output - elsewhere.output) > 2.0 * SIGMA  # it has no friction, the fit has
