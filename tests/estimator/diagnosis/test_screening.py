"""The first look: its promise is what a linear problem gives, and phases, moments and sizes are found without a fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from estimator.diagnosis.inference.hypotheses import NOTHING, all_good_samples
from estimator.diagnosis.inference.score_tests import ScoredStart, Screen, promising
from estimator.physics.driveline import InitialCondition
from estimator.physics.effect import Element
from estimator.physics.fit import FitResult
from estimator.physics.model import DrivelineModel
from estimator.physics.unknowns import Release, Shared
from estimator.signals.record import Record
from tests.estimator.diagnosis.plain import Bench
from tests.estimator.diagnosis.planted import SIGMA, TIGHT, disturbed, drive_torque
from tests.estimator.physics.bench import (
    ONE_MASS,
    SPEED,
    TWO_MASS,
    exact_states,
    linear_record,
    model,
    random_steps,
    record,
)

SAMPLES = 1200

Looked = tuple[list[ScoredStart], FitResult, FitResult]
"""Looks around the re-tuned nominal fit, that fit, and the one with the effect."""


def looked_at(line: DrivelineModel, records: Sequence[Record], name: str) -> Looked:
    bench = Bench(line, records, all_good_samples(records))
    retuned = bench.fit(NOTHING)
    return Screen(retuned, line).starts(name), retuned, bench.fit(frozenset({name}), retuned)


def starts(unknowns: Sequence[Shared]) -> dict[str, float]:
    return {unknown.name: unknown.scale * unknown.start for unknown in unknowns}


GAIN = 0.9


def with_gain(gain: float) -> list[Record]:
    """One mass whose second torque is ``gain`` times its reading."""
    found = []
    for seed, share in ((1, 0.5), (2, 0.65)):
        torque = drive_torque(seed, SAMPLES)
        other = random_steps(SAMPLES, seed + 20, size_nm=20.0, hold=7)
        m1, m2 = share * torque + other, (1.0 - share) * torque - other
        rec = linear_record(ONE_MASS, m1 + gain * m2, InitialCondition(5.0, 0.0, 2.0), sigma=SIGMA, seed=seed)
        found.append(replace(rec, name=f"run_{seed}", torque_nm=np.column_stack([m1, m2])))
    return found


@pytest.fixture(scope="module")
def wrong_gain() -> Looked:
    """In a line whose parameters are trusted exactly: an ordinary regression."""
    return looked_at(model(ONE_MASS, 0.0), with_gain(GAIN), "inverter_gain_mismatch")


class TestLinear:
    def test_the_promise_is_what_the_fit_then_gains(self, wrong_gain: Looked) -> None:
        looks, retuned, fitted = wrong_gain
        assert fitted.squares < 0.1 * retuned.squares
        assert looks[0].promise == pytest.approx(retuned.squares - fitted.squares, rel=1e-6)

    def test_the_most_promising_start_comes_first(self, wrong_gain: Looked) -> None:
        """The other inverter is the wrong one, and promises less."""
        promises = [look.promise for look in wrong_gain[0]]
        assert len(promises) == 2
        assert promises[0] > 1.2 * promises[1] > 0.0


AMPLITUDE_NM, RATIO, PHASES = 8.0, 5.6, (0.5, -2.0)


def unbalanced(seed: int, phase_rad: float) -> Record:
    torque, start = drive_torque(seed, SAMPLES) + 120.0, InitialCondition(5.0, 0.0, 20.0, 0.0, 20.0)
    speed = disturbed(Element.LOAD, lambda moved: np.cos(moved.angle / RATIO + phase_rad), AMPLITUDE_NM, torque, start)
    noise = SIGMA * np.random.default_rng(seed).standard_normal(SAMPLES)
    return record(torque, speed + noise, name=f"run_{seed}")


@pytest.fixture(scope="module")
def imbalance() -> Looked:
    records = [unbalanced(seed, phase_rad) for seed, phase_rad in zip((1, 2), PHASES, strict=True)]
    return looked_at(replace(model(TWO_MASS, TIGHT), gear_ratio=RATIO), records, "load_imbalance")


class TestPhases:
    def test_each_recording_has_its_own(self, imbalance: Looked) -> None:
        (look,), _, _ = imbalance
        found = [starts(own)["phase_rad"] for own in look.release.own]
        assert found == pytest.approx(PHASES, abs=0.1)

    def test_the_promise_is_what_the_fit_then_gains(self, imbalance: Looked) -> None:
        (look,), retuned, fitted = imbalance
        gained = retuned.squares - fitted.squares
        assert gained > 0.5 * retuned.squares
        assert look.promise == pytest.approx(gained, rel=0.02)


INERTIA, CLOSED_S = 5.0, ((2.0, 5.0), (6.0, 9.5), None)


def with_clutch(seed: int, closed_s: tuple[float, float] | None) -> Record:
    """One mass with a generator for a while, piece by piece: its speed continues as it was, on both sides the same."""
    torque, pieces, start = drive_torque(seed, SAMPLES), [], InitialCondition(5.0, 0.0, 2.0)
    cuts = [0, *(round(100 * moment) for moment in closed_s or ()), SAMPLES]
    for number, (first, last) in enumerate(pairwise(cuts)):
        values = ONE_MASS | {"J_M": ONE_MASS["J_M"] + (INERTIA if number == 1 else 0.0)}
        states = exact_states(values, np.append(torque[first:last], 0.0), start)
        pieces.append(states[:-1, SPEED])
        start = replace(start, speed_rad_s=float(states[-1, SPEED]))
    noise = SIGMA * np.random.default_rng(seed).standard_normal(SAMPLES)
    return record(torque, np.concatenate(pieces) + noise, name=f"run_{seed}")


@pytest.fixture(scope="module")
def coupled() -> Looked:
    """In two recordings closed for a while, in a third never."""
    records = [with_clutch(seed, closed_s) for seed, closed_s in zip((1, 2, 3), CLOSED_S, strict=True)]
    return looked_at(model(ONE_MASS, TIGHT), records, "generator_coupled")


class TestMoments:
    def test_each_recording_has_its_own(self, coupled: Looked) -> None:
        """To a cell of half a second."""
        for own, closed_s in zip(coupled[0][0].release.own, CLOSED_S, strict=True):
            if closed_s is not None:
                assert [unknown.start for unknown in own] == pytest.approx(closed_s, abs=0.5)

    def test_a_fit_may_move_them_by_a_cell(self, coupled: Looked) -> None:
        for own in coupled[0][0].release.own[:2]:
            for unknown in own:
                assert unknown.low == pytest.approx(max(unknown.start - 0.5, 0.0))
                assert unknown.high == pytest.approx(min(unknown.start + 0.5, 12.0))

    def test_the_fit_reaches_the_noise_from_there(self, coupled: Looked) -> None:
        (best, *_), retuned, fitted = coupled
        assert retuned.rms > 4.0 * SIGMA
        assert fitted.rms == pytest.approx(SIGMA, rel=0.05)
        assert best.promise > 0.5 * (retuned.squares - fitted.squares)


class TestPromising:
    """Starts of one law: with two parameters free, or with one of them held."""

    @staticmethod
    def look(promise: float, held: bool = False) -> ScoredStart:
        free = Shared("tyre_slip", "slip_per_nm", 1.0, 0.0, 1.0, 0.5)
        other = Shared("tyre_slip", "wheel_share", 1.0, *((0.1, 0.1) if held else (0.0, 1.0)), 0.1)
        return ScoredStart(Release((free, other), ((),)), promise)

    def test_the_best_and_a_second_that_promises_nearly_as_much(self) -> None:
        looks = [self.look(promise) for promise in (10.0, 9.0, 8.0)]
        assert promising(looks) == looks[:2]
        assert promising([looks[0], self.look(4.0)]) == looks[:1]
