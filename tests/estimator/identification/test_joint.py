"""One model of several recordings: nearer to the truth than each, and of those alone that agree."""

from dataclasses import replace

import numpy as np
import pytest

from estimator.identification.best import BestEstimate, ModelVerdict, best_estimate
from estimator.identification.joint import joint_estimate
from estimator.signals.record import sliced
from tests.estimator.identification.driveline import J_L, LINE, Line, cruise

STIFFER = replace(LINE, k=1.1 * LINE.k)


def estimates(*lines: Line) -> list[BestEstimate]:
    return [best_estimate(cruise(seed, 15.0, 0.1, 30.0, line=line).record) for seed, line in enumerate(lines)]


@pytest.fixture(scope="module")
def four() -> list[BestEstimate]:
    return estimates(LINE, LINE, LINE, STIFFER)


def test_three_of_one_line_say_more_together_than_each(four: list[BestEstimate]) -> None:
    joint, reason = joint_estimate("abc", four[:3])
    assert joint is not None, reason
    assert (joint.names, joint.disagreeing) == (("a", "b", "c"), {})
    assert joint.mode is not None
    assert joint.physical is not None
    frequency_hz, damping = LINE.resonance
    for found, truth, single in (
        (joint.mode.frequency_hz, frequency_hz, [each.mode.frequency_hz for each in four[:3] if each.mode]),
        (joint.mode.damping, damping, [each.mode.damping for each in four[:3] if each.mode]),
    ):
        assert found.covers(truth)
        assert found.std == pytest.approx(sum(each.std**-2 for each in single) ** -0.5, rel=0.15)
    assert joint.physical.parameters["J_L"].estimate.covers(J_L)


def test_a_recording_of_another_line_is_left_out_and_named(four: list[BestEstimate]) -> None:
    joint, _ = joint_estimate("abcd", four)
    assert joint is not None
    assert joint.names == ("a", "b", "c")
    assert set(joint.disagreeing) == {"d"}
    assert joint.disagreeing["d"] < 1e-6


def test_a_recording_that_the_model_is_not_good_for_is_named(four: list[BestEstimate]) -> None:
    """Its intervals can't be trusted, nor those of the joint estimate."""
    joint, _ = joint_estimate("ab", [four[0], replace(four[1], verdict=ModelVerdict.NOT_LINEAR)])
    assert joint is not None
    assert joint.doubtful == ("b",)


def test_the_same_samples_do_not_count_twice() -> None:
    """A part of a recording under another name, at another time and rounded."""
    whole = cruise(7, 20.0, 0.1, 30.0).record
    part = sliced(whole, slice(700, 1700))
    part = replace(part, time_s=part.time_s + 5.0, output=part.output.round(3))
    joint, reason = joint_estimate(("whole", "part"), [best_estimate(whole), best_estimate(part)])
    assert joint is None
    assert reason == "whole and part hold the same samples, which count once: leave one out"


def test_two_that_do_not_agree_have_no_joint_estimate(four: list[BestEstimate]) -> None:
    assert joint_estimate("ad", four[::3]) == (None, "a and d do not agree on one line")


def test_other_periods_are_not_put_together(four: list[BestEstimate]) -> None:
    slower = replace(four[1], problem=replace(four[1].problem, sample_time_s=0.02))
    joint, reason = joint_estimate("ab", [four[0], slower])
    assert joint is None
    assert "sampled at different periods" in reason


def test_the_order_of_the_recordings_does_not_matter(four: list[BestEstimate]) -> None:
    forward, _ = joint_estimate("abc", four[:3])
    backward, _ = joint_estimate("cba", four[2::-1])
    assert forward is not None
    assert backward is not None
    np.testing.assert_allclose(forward.model.theta, backward.model.theta, rtol=1e-3)
