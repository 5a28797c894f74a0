"""What recordings must be for a diagnosis: of one kind, long enough, exciting, read and not cut off."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis import diagnose
from estimator.diagnosis.preconditions.channels import clipped, not_read, unwrapped, without_clipped, without_not_read
from estimator.diagnosis.preconditions.excitation import model_warnings, require_excitation
from estimator.diagnosis.preconditions.prepare import prepare
from estimator.diagnosis.result import Verdict
from estimator.diagnosis.thresholds import Recordings
from estimator.errors import BadShape, NotExciting
from estimator.physics.driveline import InitialCondition
from estimator.signals.record import FloatArray, OutputKind, Record
from tests.estimator.physics.bench import ONE_MASS, TWO_MASS, linear_record, model, random_steps, record, scaled

LINE = model(ONE_MASS)


def drive(name: str = "run_1", samples: int = 400) -> Record:
    return linear_record(
        ONE_MASS, random_steps(samples, seed=1), InitialCondition(0.0, 0.0, 3.0), sigma=0.01, name=name
    )


@pytest.mark.parametrize("holdout", [False, True])
def test_a_name_used_twice(holdout: bool) -> None:
    message = "recordings must have different names, got run_1, run_1. Rename the files."
    with pytest.raises(BadShape, match=message):
        prepare([drive()] if holdout else [drive(), drive()], LINE, [drive()] if holdout else [])


def test_different_sampling_periods() -> None:
    slow = replace(drive("slow"), sample_time_s=0.02)
    message = r"recording slow: sampling period 0.02 s, expected 0.01 s as in run_1. Diagnose recordings of one period"
    with pytest.raises(BadShape, match=message):
        prepare([drive(), slow], LINE, [])


def test_different_outputs() -> None:
    position = replace(drive("turned"), kind=OutputKind.POSITION)
    message = r"recording turned: output is position at the motor, expected speed at the motor as in run_1"
    with pytest.raises(BadShape, match=message):
        prepare([drive()], LINE, [position])


@pytest.mark.parametrize("samples", [Recordings.FEWEST_SAMPLES - 1, 20])
def test_too_short(samples: int) -> None:
    message = f"recording run_1: {samples} good samples, expected at least {Recordings.FEWEST_SAMPLES}. Record longer."
    with pytest.raises(NotExciting, match=message):
        prepare([drive(samples=samples)], LINE, [])


def test_too_much_masked() -> None:
    rec = drive()
    with pytest.raises(NotExciting, match="run_1: 150 good samples, expected at least 200"):
        prepare([replace(rec, okay=np.arange(400) < 150)], LINE, [])


def test_another_number_of_torques() -> None:
    rec = drive("two")
    both = replace(rec, torque_nm=np.column_stack([rec.torque_nm, rec.torque_nm]))
    with pytest.raises(BadShape, match="recording two: 2 torque inputs, expected 1 as in run_1"):
        prepare([drive(), both], LINE, [])


def test_what_there_is_to_say_goes_into_the_diagnosis() -> None:
    """Of 30 s, 3 s of it were lost."""
    rec = drive(samples=3000)
    lost = replace(rec, okay=~((np.arange(3000) >= 1000) & (np.arange(3000) < 1300)))
    found = diagnose([lost], LINE)
    assert found.warnings == (
        "recording run_1: gaps of more than 1 s cut it into 2 segments, each with its own initial state and constant "
        "load.",
    )
    assert found.verdict is Verdict.NO_MISMATCH


def test_a_torque_that_never_changes() -> None:
    rec = drive("dead")
    flat = replace(rec, torque_nm=np.full((400, 1), 12.5))
    message = r"recording dead: the torque is constant at 12.5, expected it to vary. Excite the driveline"
    with pytest.raises(NotExciting, match=message) as refusal:
        prepare([drive(), flat], LINE, [])
    assert refusal.value.names == ("dead",)


def test_all_recordings_at_fault_are_refused_together() -> None:
    with pytest.raises(NotExciting, match=r"recording a: 100 good .*\nrecording b: 50 good") as refusal:
        prepare([drive("a", samples=100), drive("b", samples=50), drive()], LINE, [])
    assert refusal.value.__notes__ == ["Correct or leave out what is named; recordings without such a fault: 1."]


def test_a_dead_torque_is_named() -> None:
    sound = drive()
    dead = replace(sound, torque_nm=np.column_stack([sound.torque_nm[:, 0], np.zeros(400)]))
    assert any("torque input 2 stays at 0" in text for text in prepare([dead], LINE).warnings)
    assert not any("stays at" in text for text in prepare([sound], LINE).warnings)


def test_the_diagnosis_refuses_before_it_fits() -> None:
    called = []
    with pytest.raises(NotExciting, match="Record longer"):
        diagnose([drive(samples=100)], LINE, progress=lambda message, share: called.append(message))
    assert called == ["checking the recordings"]


N = 3000
TIME_S = 0.01 * np.arange(N)
SWING = 10.0 * np.sin(TIME_S) + 0.5 * np.sin(9.0 * TIME_S)
SEEN = np.ones(N, dtype=bool)


def drive_cut_off() -> Record:
    return linear_record(ONE_MASS, random_steps(N, seed=1), InitialCondition(0.0, 0.0, 3.0), sigma=0.02)


@pytest.mark.parametrize(("limit", "sign"), [(8.0, 1.0), (8.0, -1.0), (9.9, 1.0)])
def test_a_reading_cut_off_is_found(limit: float, sign: float) -> None:
    found = clipped("speed", sign * np.minimum(SWING, limit), SEEN)
    assert [each.value for each in found] == [sign * limit]
    assert np.array_equal(found[0].rows, SWING >= limit)


SOUND: dict[str, FloatArray] = {
    "a swing": SWING,
    "a swing read in coarse steps": np.round(SWING),
    "a swing read in fine steps": np.round(10.0 * np.sin(TIME_S), 2),
    "settled, read in steps": np.round(30.0 * (1.0 - np.exp(-2.0 * TIME_S)), 3),
    "settled to the last bit": 30.0 * (1.0 - np.exp(-10.0 * TIME_S)),
    "at rest": np.maximum(SWING, 0.0),
    "held at several values": np.repeat([10.0, 20.0, 15.0, 20.0], N // 4),
    "on and off": random_steps(N, seed=2),
    "forward, off, back": np.sign(SWING) * (np.abs(SWING) > 3.0),
    "a quantised cruise": np.round(50.0 + 0.3 * np.random.default_rng(2).standard_normal(N)),
}


@pytest.mark.parametrize("name", SOUND)
def test_what_is_not_cut_off_is_let_be(name: str) -> None:
    assert clipped("speed", SOUND[name], SEEN) == []


def test_rows_that_were_not_read_do_not_count() -> None:
    cut = np.minimum(SWING, 8.0)
    assert clipped("speed", cut, SWING < 8.0) == []
    assert clipped("speed", cut, np.zeros(N, dtype=bool)) == []


def test_the_output_is_masked_where_it_is_cut_off() -> None:
    whole = drive_cut_off()
    limit = float(np.quantile(whole.output, 0.9))
    cut = replace(whole, output=np.minimum(whole.output, limit))
    (mended,), warnings = without_clipped([cut])
    assert np.array_equal(mended.okay, whole.output < limit)
    assert warnings == [
        f"recording run: the speed stands at its limit {limit:g} in 10.0% of the rows: its reading is cut off there; "
        "these rows are not used. Widen the range of the sensor or of its scale."
    ]


def test_a_torque_at_its_limit_is_reported_and_stays() -> None:
    whole = drive_cut_off()
    cut = replace(whole, torque_nm=np.column_stack([SWING, np.minimum(SWING, 8.0)]))
    (mended,), warnings = without_clipped([cut])
    assert mended is cut
    assert len(warnings) == 1
    assert "recording run: torque input 2 stands at its limit 8 in " in warnings[0]
    assert "the verdict can't be trusted: mask these rows" in warnings[0]


EXCITED_LINE = model(TWO_MASS)
SIGMA = 0.02


def noise(size: float, seed: int) -> np.ndarray:
    return size * np.random.default_rng(seed).standard_normal(N)


def excited_drive(torque_nm: np.ndarray, name: str = "run") -> Record:
    return linear_record(TWO_MASS, torque_nm, InitialCondition(10.0, 0.0, 20.0, 0.0, 20.0), sigma=SIGMA, name=name)


def test_noise_alone_is_refused() -> None:
    still = record(50.0 + noise(0.3, 1), 40.0 + noise(SIGMA, 2))
    with pytest.raises(
        NotExciting, match=r"the speed moves by .* beyond a noise of 0.0\d*, expected more than the noise"
    ):
        prepare([still], EXCITED_LINE)


def test_zeros_of_lost_readings_are_no_noise() -> None:
    """At 84 rad/s every lost reading is a spike, and 3 % of them are more than all that the torque moves."""
    run = linear_record(TWO_MASS, random_steps(N, 1), InitialCondition(84.0, 0.0, 84.0, 0.0, 84.0), sigma=SIGMA)
    lost = np.random.default_rng(3).random(N) < 0.03
    read = replace(run, output=np.where(lost, 0.0, np.round(run.output, 5)))
    with pytest.raises(NotExciting):
        require_excitation([read], EXCITED_LINE)
    assert prepare([read], EXCITED_LINE).warnings == prepare([run], EXCITED_LINE).warnings


def test_a_torque_that_moves_nothing_is_refused() -> None:
    """The line coasts: it moves, but the torque has no part in it."""
    coast = record(
        noise(0.02, 1),
        80.0 * np.exp(-0.05 * 0.01 * np.arange(N)) + noise(SIGMA, 2),
        name="coast",
    )
    with pytest.raises(NotExciting, match=r"less than its noise of .*: the torque read excites nothing") as refusal:
        prepare([coast], EXCITED_LINE)
    assert refusal.value.names == ("coast",)


def slow_torque() -> np.ndarray:
    return 100.0 * np.sin(0.4 * 0.01 * np.arange(N))


def test_a_mode_that_is_not_excited_is_reported() -> None:
    (warning,) = prepare([excited_drive(slow_torque())], EXCITED_LINE).warnings
    assert warning.startswith("at and above the model's first mode (8.32 Hz) the torque moves the speed by")
    assert "stiffness, damping and effects of the shaft can't be determined" in warning
    assert warning.endswith("Superpose a PRBS, or a tip-in.")


def test_a_mode_too_fast_for_the_sampling_is_reported() -> None:
    stiff = model(scaled(TWO_MASS, k=100.0))
    (warning,) = require_excitation([excited_drive(random_steps(N, 1))], stiff)
    assert "first mode is at 83.2 Hz, beyond the 50 Hz that a sampling period of 0.01 s can show" in warning


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"J_M": 3e4}, "J_L = 40 and J_M = 48000 differ by a factor of 1.2e+03"),
        ({"J_L": 1e3}, "J_M = 1.6 and J_L = 40000 differ by a factor of 2.5e+04"),
        ({"c": 100.0}, "with c = 900 and k = 4200 the first mode (8.32 Hz) is damped 5.6 times critically"),
    ],
)
def test_values_that_are_hardly_meant_are_reported(changes: dict[str, float], said: str) -> None:
    (warning,) = model_warnings(model(scaled(TWO_MASS, **changes)))
    assert said in warning
    assert warning.endswith("?")


def test_they_are_among_the_warnings_of_a_diagnosis() -> None:
    damped = model(scaled(TWO_MASS, c=100.0))
    ready = prepare([excited_drive(random_steps(N, 1))], damped)
    assert any("times critically" in warning for warning in ready.warnings)
    assert ready.records == ready.segments.records
    assert replace(ready, warnings=()).holdout == ()


GAP = slice(1000, 1400)


def drive_not_read(kind: OutputKind = OutputKind.SPEED, sigma: float = 0.02) -> Record:
    return linear_record(ONE_MASS, random_steps(N, seed=1), InitialCondition(0.0, 0.0, 3.0), sigma=sigma, kind=kind)


def interpolated(values: FloatArray, gap: slice = GAP) -> FloatArray:
    filled = values.copy()
    filled[gap] = np.linspace(values[gap.start - 1], values[gap.stop], gap.stop - gap.start + 2)[1:-1]
    return filled


@pytest.mark.parametrize("digits", [4, 6, 15])
@pytest.mark.parametrize("length", [20, 400])
def test_an_interpolated_gap_is_found_and_masked(digits: int, length: int) -> None:
    gap = slice(1000, 1000 + length)
    speed = np.round(interpolated(drive_not_read().output + 0.05 * TIME_S**2, gap), digits)
    (record,), (warning,) = without_not_read([replace(drive_not_read(), output=speed)])
    assert not record.okay[gap].any()
    assert record.okay.sum() >= N - length - 4
    assert "straight lines" in warning
    assert record.name in warning


def test_a_reading_that_has_stopped_is_found_and_masked() -> None:
    speed = drive_not_read().output
    speed[GAP] = speed[GAP.start]
    (record,), (warning,) = without_not_read([replace(drive_not_read(), output=speed)])
    assert not record.okay[GAP].any()
    assert record.okay.sum() >= N - 404
    assert "stands still" in warning


def test_what_is_masked_is_a_gap_of_the_diagnosis() -> None:
    """A long one cuts the recording: each segment has an initial state and a load of its own."""
    ready = prepare(
        [replace(drive_not_read(), output=interpolated(drive_not_read().output))],
        model(ONE_MASS),
    )
    assert [record.name for record in ready.records] == ["run#1", "run#2"]
    assert any("straight lines" in warning for warning in ready.warnings)


noise_read = 0.02 * np.random.default_rng(3).standard_normal(N)
swing = 10.0 * np.sin(TIME_S) + 0.5 * np.sin(9.0 * TIME_S)
SOUND_READ: dict[str, FloatArray] = {
    "a noisy drive": drive_not_read().output,
    "a drive without noise": drive_not_read(sigma=0.0).output,
    "a swing without noise": swing,
    "a swing read in coarse steps": np.round(swing),
    "a swing read in fine steps": np.round(swing, 2),
    "a ramp read in coarse steps": np.round(3.0 * TIME_S, 1),
    "a cruise read in coarse steps": np.round(50.0 + 0.3 * noise_read, 1),
    "at rest, and moving": np.where(TIME_S < 10.0, 0.0, swing + noise_read),
    "a free fall without noise": 9.81 * TIME_S,
    "settled to the last bit": 30.0 * (1.0 - np.exp(-10.0 * TIME_S)),
    "nothing": np.zeros(N),
}


@pytest.mark.parametrize("name", SOUND_READ)
def test_what_was_read_stays(name: str) -> None:
    assert not_read("speed", SOUND_READ[name], SEEN, may_rest=False) == []


@pytest.mark.parametrize("period", [2.0 * np.pi, 0.5])
def test_a_wrapped_position_is_put_together_again(period: float) -> None:
    record = drive_not_read(OutputKind.POSITION, sigma=1e-4)
    wrapped = np.mod(record.output, period) + 0.1
    (mended,), (warning,) = unwrapped([replace(record, output=wrapped)])
    offset = mended.output - record.output
    assert np.ptp(offset) < 0.02 * period
    assert record.name in warning
    if period > 1.0:
        assert np.ptp(offset) == pytest.approx(0.0, abs=1e-9)
