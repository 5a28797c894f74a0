"""Work and memory follow from the data: what they can't carry is refused, or left out, before room is made for it."""

import math
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.segments import cut, shortened_to_memory
from estimator.diagnosis.thresholds import Recordings
from estimator.errors import BadSetting
from estimator.identification.identify import identify
from estimator.signals.decimate import HALF_LENGTH, MOST_FACTOR, Decimated, Decimator, decimate, low_pass_taps
from estimator.signals.record import FloatArray, Record, sliced

SAMPLE_TIME_S = 0.01


def tone(frequency_hz: float, n: int = 4000) -> FloatArray:
    return np.sin(2 * np.pi * frequency_hz * SAMPLE_TIME_S * np.arange(n))


def chain(y: FloatArray, okay: np.ndarray | None = None, factor: int = 2) -> Decimated:
    mask = np.ones(y.shape, dtype=bool) if okay is None else okay
    return Decimator(SAMPLE_TIME_S, factor).run(2.0 * np.nan_to_num(y), y, mask)


def settled_amplitude(frequency_hz: float) -> float:
    kept = chain(tone(frequency_hz))
    return float(np.sqrt(2.0) * kept.y[kept.okay][500:].std())


def record(n: int = 500) -> Record:
    rng = np.random.default_rng(3)
    return Record(
        name="run_1",
        sample_time_s=SAMPLE_TIME_S,
        time_s=5.0 + SAMPLE_TIME_S * np.arange(n),
        torque_nm=rng.normal(size=(n, 2)),
        output=rng.normal(size=n),
        okay=np.ones(n, dtype=bool),
    )


@pytest.mark.parametrize("frequency_hz", [4.0, 8.2, 19.0])
def test_the_band_of_the_resonance_passes(frequency_hz: float) -> None:
    assert settled_amplitude(frequency_hz) == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize("frequency_hz", [31.0, 42.0, 48.0])
def test_what_would_fold_back_into_that_band_is_damped_by_50_db(frequency_hz: float) -> None:
    assert settled_amplitude(frequency_hz) < 10 ** (-50 / 20)


def test_a_constant_goes_and_the_corner_is_at_three_decibels() -> None:
    constant = chain(np.full(4000, 130.0))
    assert abs(constant.y).max() < 1e-9
    assert settled_amplitude(0.3) == pytest.approx(np.sqrt(0.5), abs=0.02)


@pytest.mark.parametrize("factor", [1, 2, 5])
def test_a_block_and_single_samples_give_the_same_bits(factor: int) -> None:
    rng = np.random.default_rng(1)
    u, y, okay = rng.normal(size=700), rng.normal(size=700), rng.random(700) > 0.05
    y[~okay] = np.nan
    block = Decimator(SAMPLE_TIME_S, factor).run(u, y, okay)
    live = Decimator(SAMPLE_TIME_S, factor)
    pieces = [live.run(u[k : k + 1], y[k : k + 1], okay[k : k + 1]) for k in range(700)]
    assert np.array_equal(block.u, np.concatenate([p.u for p in pieces]))
    assert np.array_equal(block.y, np.concatenate([p.y for p in pieces]))
    assert np.array_equal(block.okay, np.concatenate([p.okay for p in pieces]))
    assert block.u.shape == (-(-700 // factor),)


def test_a_bad_sample_spoils_exactly_the_outputs_whose_window_holds_it() -> None:
    n, bad, taps = 400, 201, low_pass_taps(2).shape[0]
    y, okay = tone(8.2, n), np.ones(n, dtype=bool)
    okay[bad] = False
    newest = 2 * np.arange(n // 2)  # newest input sample of each output's window
    expected = (newest >= taps - 1) & ~((newest >= bad) & (newest < bad + taps))
    assert np.array_equal(chain(y, okay).okay, expected)


def test_unspoilt_outputs_do_not_depend_on_a_bad_value() -> None:
    y, okay = tone(8.2, 1000), np.ones(1000, dtype=bool)
    okay[300] = False
    outputs = []
    for value in (np.nan, np.inf, 1e9):
        y[300] = value
        outputs.append(Decimator(SAMPLE_TIME_S, 2).run(tone(3.0, 1000), y, okay))
    for kept in outputs:
        assert np.isfinite(kept.y).all()
        assert np.array_equal(kept.y, outputs[0].y)


def test_the_recording_is_not_changed_and_torques_are_summed() -> None:
    source = record()
    before = (source.torque_nm.copy(), source.output.copy(), source.okay.copy())
    kept = decimate(source, 2)
    for array, copy in zip((source.torque_nm, source.output, source.okay), before, strict=True):
        assert np.array_equal(array, copy)
    expected = Decimator(SAMPLE_TIME_S, 2).run(source.torque_nm.sum(axis=1), source.output, source.okay)
    assert kept.torque_nm.shape == (250, 1)
    assert np.array_equal(kept.total_torque_nm, expected.u)
    assert kept.time_s[HALF_LENGTH] == pytest.approx(5.0)


@pytest.mark.parametrize(
    ("settings", "named"),
    [
        ((0.01, 0, 0.3), "factor is 0"),
        ((0.0, 2, 0.3), "sample_time_s is 0.0"),
        ((0.01, 2, 0.0), "high_pass_hz is 0.0"),
        ((0.01, 2, 25.0), "below 25 Hz"),
        ((0.01, 2, float("nan")), "high_pass_hz is nan"),
    ],
)
def test_settings_out_of_range_are_refused(settings: tuple[float, int, float], named: str) -> None:
    with pytest.raises(BadSetting, match=named):
        Decimator(*settings)


N = 3000
RNG = np.random.default_rng(1)


def bounded(sample_time_s: float) -> Record:
    okay = np.ones(N, dtype=bool)
    return Record(
        "fast", sample_time_s, sample_time_s * np.arange(N), RNG.normal(size=(N, 1)), RNG.normal(size=N), okay
    )


@pytest.mark.parametrize("sample_time_s", [1e-9, 1e-7])
def test_samples_far_too_fast_for_the_models_are_refused_without_a_filter_for_them(sample_time_s: float) -> None:
    tracemalloc.start()
    with pytest.raises(BadSetting, match=f"factor .* expected 1 to {MOST_FACTOR}; is time in s"):
        identify(bounded(sample_time_s))
    assert tracemalloc.get_traced_memory()[1] < 1 << 24
    tracemalloc.stop()
    assert Decimator(0.02 / MOST_FACTOR, MOST_FACTOR).delay_samples > 0


def named(count: int, samples: int = N) -> list[Record]:
    whole = bounded(0.01)
    return [replace(sliced(whole, slice(0, samples)), name=f"run_{i}") for i in range(count)]


@pytest.mark.parametrize(("count", "samples"), [(50, N), (13, N), (200, 300), (800, 100)])
def test_of_more_recordings_than_a_fit_can_hold_some_of_every_part_are_used(count: int, samples: int) -> None:
    """Fifty of 3000 rows took 7 GiB: each has unknowns of its own, and a fit every sample for every unknown."""
    records = named(count, samples)
    segments, (warning,) = shortened_to_memory(cut(records), [each.name for each in records])
    used = [int(each.name.removeprefix("run_")) for each in segments.records]
    assert used == sorted(set(used))
    assert (
        Recordings.MOST_SAMPLES_TIMES_RECORDINGS / 2
        < len(used) ** 2 * samples
        <= Recordings.MOST_SAMPLES_TIMES_RECORDINGS
    )
    assert max(np.diff([-1, *used, count])) <= 2 * math.ceil(count / len(used))
    assert warning.startswith(f"{len(used)} of {count} recordings are used")
    assert len({i % 2 for i in used}) == len({i % 3 for i in used}) - 1 == 2  # kinds that take turns are all there
