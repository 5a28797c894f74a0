"""A nominal line beyond its tolerances: what a wrong value leaves is no missing physics."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import pytest

from estimator.diagnosis.bench import Bench
from estimator.diagnosis.beyond import FREELY, LineBeyond, in_words, line_beyond
from estimator.diagnosis.diagnose import diagnose
from estimator.diagnosis.hypotheses import NOTHING, everything
from estimator.diagnosis.judgement import judge
from estimator.diagnosis.result import Diagnosis, Stray, Verdict
from estimator.physics.effect import Element
from estimator.physics.fit import FitResult
from estimator.physics.model import DrivelineModel
from estimator.signals.record import Record
from tests.estimator.diagnosis.outcome import outcome
from tests.estimator.diagnosis.planted import SIGMA, quiet
from tests.estimator.diagnosis.regression import of_rms
from tests.estimator.physics.bench import TWO_MASS, model

LAG = frozenset({"actuator_lag"})


def off_by(factors: Mapping[str, float], tolerance: float) -> DrivelineModel:
    """A nominal model whose true values are these factors times its own."""
    return model({name: value / factors.get(name, 1.0) for name, value in TWO_MASS.items()}, tolerance)


def retuned(line: DrivelineModel, records: Sequence[Record]) -> FitResult:
    return Bench(line, records, everything(records)).fit(NOTHING)


@pytest.mark.parametrize(
    ("name", "factor", "element"),
    [("k", 1.3, Element.SHAFT), ("J_M", 0.8, Element.MOTOR), ("J_L", 1.25, Element.LOAD), ("k", 0.7, Element.SHAFT)],
)
def test_what_left_its_tolerance_is_told_with_its_size_and_place(name: str, factor: float, element: Element) -> None:
    beyond = line_beyond(retuned(off_by({name: factor}, 0.1), quiet()))
    assert beyond is not None
    assert beyond.result.rms == pytest.approx(SIGMA, rel=0.03)
    (stray,) = beyond.strays
    assert (stray.name, stray.element, stray.tolerance) == (name, element, pytest.approx(0.1))
    assert stray.ratio == pytest.approx(factor, rel=0.03)


def test_two_that_left_are_both_told() -> None:
    beyond = line_beyond(retuned(off_by({"k": 1.3, "J_M": 1.2}, 0.1), quiet()))
    assert beyond is not None
    assert {stray.name for stray in beyond.strays} == {"k", "J_M"}


@pytest.mark.parametrize("factor", [1.0, 1.08])
def test_inside_its_tolerances_nothing_is_beyond(factor: float) -> None:
    assert line_beyond(retuned(off_by({"k": factor}, 0.1), quiet())) is None


def test_no_value_is_sought_that_is_no_slip_of_a_data_sheet() -> None:
    beyond = line_beyond(retuned(off_by({"k": 2.0 * FREELY}, 0.1), quiet()))
    assert beyond is not None
    assert max(stray.ratio for stray in beyond.strays) <= FREELY
    assert beyond.result.rms > 2.0 * SIGMA


def test_a_stray_is_said_with_its_tolerance() -> None:
    said = in_words([Stray("k", 1.166, 0.04), Stray("J_L", 0.9, 0.05)])
    assert said == (
        "k 17 % above its nominal value (trusted to 4 %) and J_L 10 % below its nominal value (trusted to 5 %)"
    )


class TestTheVerdict:
    """On white errors of a given RMS, floor 0.1."""

    STRAYS = (Stray("k", 1.3, 0.1),)

    def beyond(self, rms: float) -> LineBeyond:
        return LineBeyond(of_rms(rms, 4), self.STRAYS)

    @pytest.mark.parametrize(
        ("left", "by_the_line", "believed"),
        [
            (0.101, 0.2, True),
            (0.102, 0.101, False),  # the line does as well by itself
            (0.14, 0.13, False),  # and where neither is at the noise
            (0.14, 0.3, True),
        ],
    )
    def test_effects_must_explain_more_than_the_line_itself(
        self, left: float, by_the_line: float, believed: bool
    ) -> None:
        judged = judge(outcome(of_rms(2.0, 3), LAG, of_rms(left, 4), beyond=self.beyond(by_the_line)), 0.1)
        assert (judged.objection == "") is believed
        if not believed:
            assert judged.objection.endswith("with k 30 % above its nominal value (trusted to 10 %)")

    @pytest.mark.parametrize(("by_the_line", "told"), [(0.101, STRAYS), (0.2, ())])
    def test_with_nothing_chosen_it_is_told_where_it_reaches_the_noise(
        self, by_the_line: float, told: tuple[Stray, ...]
    ) -> None:
        judged = judge(outcome(of_rms(2.0, 3), beyond=self.beyond(by_the_line)), 0.1)
        assert (judged.verdict, judged.strays) == (Verdict.UNEXPLAINED, told)


def test_a_wrong_stiffness_is_no_missing_physics_and_is_told_as_one() -> None:
    found: Diagnosis = diagnose(quiet(), off_by({"k": 1.3}, 0.05))
    assert [stray.name for stray in found.strays] == ["k"]
    assert (found.verdict, found.effects) == (Verdict.UNEXPLAINED, ())
    assert found.mismatch.element is Element.SHAFT
    assert "no physics need be missing" in found.statement
    assert "k 30 % above its nominal value (trusted to 5 %)" in found.statement
