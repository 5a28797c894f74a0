"""Hold-out: an effect that is there shows on unseen samples, one that is not does not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.bench import Bench
from estimator.diagnosis.holdout import BLOCK_S, EVERY_S, Examiner, blocks, foreign_outputs
from estimator.diagnosis.hypotheses import NOTHING, Effects, everything
from estimator.physics.effects.road_grade import KNOT_SPACING_S
from estimator.physics.fit import FitResult, fit
from estimator.physics.start import Start
from estimator.physics.unknowns import Shared
from estimator.signals.record import Record
from tests.estimator.diagnosis.planted import SIGMA, drive_torque, quiet, rubbing
from tests.estimator.physics.bench import ONE_MASS, linear_record, model, random_steps, record

COULOMB: Effects = frozenset({"coulomb_friction_motor"})
ROAD: Effects = frozenset({"road_grade"})
BRAKE: Effects = frozenset({"brake_drag"})
LINE = model(ONE_MASS)
SAMPLES = 1200


def with_friction(seeds: tuple[int, ...] = (1, 2)) -> list[Record]:
    return rubbing(lambda speed: 12.0, seeds, SAMPLES)


def hilly(seeds: tuple[int, ...] = (1, 2)) -> list[Record]:
    found = []
    for seed in seeds:
        torque = drive_torque(seed, SAMPLES)
        hill = 30.0 * np.sin(2 * np.pi * np.arange(SAMPLES) * 0.01 / 11.0)
        start = Start(5.0, 0.0, 2.0)
        found.append(
            linear_record(ONE_MASS, torque, start, sigma=SIGMA, seed=seed, name=f"run_{seed}", extra_load_nm=hill)
        )
    return found


BRAKED_S = (2.9, 6.2)


def braked(seeds: tuple[int, ...] = (1, 2), lasts_s: tuple[float, float] = BRAKED_S) -> list[Record]:
    """Forward all along; a brake drags for a while."""
    time_s, start = np.arange(SAMPLES) * 0.01, Start(5.0, 0.0, 20.0)
    load = np.where((time_s >= lasts_s[0]) & (time_s < lasts_s[1]), 20.0, 0.0)
    return [
        linear_record(
            ONE_MASS,
            random_steps(SAMPLES, seed, mean_nm=90.0),
            start,
            sigma=SIGMA,
            seed=seed,
            name=f"run_{seed}",
            extra_load_nm=load,
        )
        for seed in seeds
    ]


def _at_most(unknown: Shared, value: float) -> Shared:
    """Hold the size of an effect low; nominal unknowns stay as they are."""
    if not unknown.effect:
        return unknown
    high = value / unknown.scale
    return replace(unknown, high=high, start=min(unknown.start, high))


def fits(records: list[Record], effects: Effects) -> tuple[FitResult, FitResult]:
    bench = Bench(LINE, records, everything(records))
    return bench.fit(NOTHING), bench.fit(effects, bench.fit(NOTHING))


class TestBlocks:
    def test_they_are_kept_out_all_along_and_not_at_the_ends(self) -> None:
        out = blocks(record(np.zeros(2000), np.zeros(2000)))
        assert out.mean() == pytest.approx(BLOCK_S / EVERY_S, abs=0.01)
        assert not out[:50].any()
        assert not out[-50:].any()
        assert BLOCK_S < KNOT_SPACING_S  # so that the profile on both sides can predict it


class TestWithoutHoldOutRecordings:
    def test_an_effect_that_is_there_shows_on_what_was_kept_out(self) -> None:
        records = with_friction()
        before, after = fits(records, COULOMB)
        held = Examiner(LINE, records, ()).compare(before, NOTHING, after, COULOMB)
        assert held.before > 2.0 * SIGMA
        assert held.after == pytest.approx(SIGMA, rel=0.15)

    def test_an_effect_that_is_not_there_shows_nothing(self) -> None:
        records = quiet(values=ONE_MASS, samples=SAMPLES)
        before, after = fits(records, COULOMB)
        held = Examiner(LINE, records, ()).compare(before, NOTHING, after, COULOMB)
        assert held.after == pytest.approx(held.before, rel=0.03)

    def test_the_fit_has_not_seen_what_was_kept_out(self) -> None:
        """Readings that are 1 rad/s off in the blocks alone do not change what is fitted, and count in full."""
        spoilt = [replace(rec, output=rec.output + np.where(blocks(rec), 1.0, 0.0)) for rec in with_friction()]
        before, after = fits(spoilt, COULOMB)
        assert after.value("coulomb_friction_motor", "friction_nm") != pytest.approx(12.0, rel=0.02)
        held = Examiner(LINE, spoilt, ()).compare(before, NOTHING, after, COULOMB)
        assert held.after == pytest.approx(np.hypot(1.0, SIGMA), rel=0.01)

    def test_a_fit_that_got_better_is_judged_by_itself(self) -> None:
        """Unseen samples are told from where the full fit ended: a poorer one seen before does not stay."""
        records = with_friction()
        before, after = fits(records, COULOMB)
        held_low = replace(after.problem, shared=tuple(_at_most(u, 3.0) for u in after.problem.shared))
        poorer = fit(held_low)
        examiner = Examiner(LINE, records, ())
        held = [examiner.compare(before, NOTHING, each, COULOMB).after for each in (poorer, after)]
        assert held[0] > 2.0 * SIGMA
        assert held[1] == pytest.approx(SIGMA, rel=0.15)

    def test_a_road_is_judged_on_blocks_that_its_neighbours_predict(self) -> None:
        records = hilly()
        before, after = fits(records, ROAD)
        held = Examiner(LINE, records, ()).compare(before, NOTHING, after, ROAD)
        assert held.before > 5.0 * SIGMA
        assert held.after < 1.5 * SIGMA

    def test_so_is_an_event(self) -> None:
        """Its moments are found from what is on both sides of the blocks, though one begins inside a block."""
        records = braked()
        assert blocks(records[0])[np.searchsorted(records[0].time_s, BRAKED_S[0])]
        before, after = fits(records, BRAKE)
        held = Examiner(LINE, records, ()).compare(before, NOTHING, after, BRAKE)
        assert held.before > 5.0 * SIGMA
        assert held.after < 1.5 * SIGMA


class TestWithHoldOutRecordings:
    def test_an_effect_that_is_there_shows_on_them(self) -> None:
        records = with_friction()
        before, after = fits(records, COULOMB)
        held = Examiner(LINE, records, with_friction((7,))).compare(before, NOTHING, after, COULOMB)
        assert held.before > 2.0 * SIGMA
        assert held.after == pytest.approx(SIGMA, rel=0.25)  # a little of the fit's own error comes along

    def test_an_effect_that_they_do_not_have_hurts(self) -> None:
        records = with_friction()
        before, after = fits(records, COULOMB)
        smooth = quiet((7,), ONE_MASS, SAMPLES)
        held = Examiner(LINE, records, smooth).compare(before, NOTHING, after, COULOMB)
        assert held.after > 2.0 * SIGMA

    def test_a_road_of_their_own_is_predicted_in_blocks(self) -> None:
        records = hilly()
        before, after = fits(records, ROAD)
        held = Examiner(LINE, records, hilly((9,))).compare(before, NOTHING, after, ROAD)
        assert held.before > 5.0 * SIGMA
        assert held.after < 1.5 * SIGMA

    def test_an_event_has_its_own_moments_in_them(self) -> None:
        records = braked()
        before, after = fits(records, BRAKE)
        held = Examiner(LINE, records, braked((5,), (5.0, 8.3))).compare(before, NOTHING, after, BRAKE)
        assert held.before > 5.0 * SIGMA
        assert held.after < 1.5 * SIGMA


def test_foreign_recordings_get_their_own_load_and_start_and_nothing_else() -> None:
    records = with_friction()
    _, fitted = fits(records, COULOMB)
    torque = drive_torque(11, SAMPLES)
    elsewhere = linear_record(ONE_MASS, torque, Start(8.0, 0.0, -4.0), sigma=SIGMA, name="elsewhere")
    (output,) = foreign_outputs(fitted, LINE, [elsewhere], [elsewhere.okay], COULOMB)
    (again,) = foreign_outputs(fitted, model(ONE_MASS, 0.9), [elsewhere], [elsewhere.okay], COULOMB)
    np.testing.assert_array_equal(output, again)
    assert np.std(output - elsewhere.output) > 2.0 * SIGMA  # it has no friction, the fit has
