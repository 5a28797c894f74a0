"""What of a recording is used: segments between gaps, stretches, thinned samples, and what is held out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from estimator.diagnosis import diagnose
from estimator.diagnosis.acquisition.chain import replay
from estimator.diagnosis.inference.figures import foreign_outputs
from estimator.diagnosis.inference.hypotheses import NOTHING, Effects, all_good_samples
from estimator.diagnosis.noise import noise_floor
from estimator.diagnosis.result import Course, Discrepancy, Equivalent, Estimated, Profile, Response, Verdict
from estimator.diagnosis.segments import cut, joined, segments, share_of, stretches
from estimator.diagnosis.thresholds import Noise, Segments
from estimator.errors import NotExciting
from estimator.physics.driveline import InitialCondition
from estimator.physics.fit import FitResult
from estimator.signals.record import Record, sliced
from tests.estimator.diagnosis.plain import Bench
from tests.estimator.diagnosis.planted import SIGMA, drive_torque, rubbing
from tests.estimator.physics.bench import ONE_MASS, SAMPLE_TIME_S, linear_record, model, random_steps, record

Rows = Sequence[tuple[int, int]]
LINE = model(ONE_MASS)
LONG = round(Segments.LONG_S / SAMPLE_TIME_S)


def drive(samples: int = 3000, bad: Rows = (), name: str = "run", load_nm: float = 5.0) -> Record:
    start = InitialCondition(load_nm, 0.0, 3.0)
    record = linear_record(ONE_MASS, random_steps(samples, seed=1), start, sigma=0.02, name=name)
    okay = np.ones(samples, dtype=bool)
    for first, end in bad:
        okay[first:end] = False
    return replace(record, okay=okay)


@pytest.mark.parametrize(
    ("bad", "parts"),
    [
        ([], [(0, 3000)]),
        ([(1000, 1000 + LONG)], [(0, 3000)]),
        ([(1000, 1000 + LONG + 1)], [(0, 1000), (1000 + LONG + 1, 3000)]),
        ([(0, LONG), (3000 - LONG, 3000)], [(0, 3000)]),
        ([(0, LONG + 1), (3000 - LONG - 1, 3000)], [(LONG + 1, 3000 - LONG - 1)]),
        ([(500, 900), (910, 1400)], [(0, 500), (900, 910), (1400, 3000)]),
    ],
)
def test_where_segments_are(bad: Rows, parts: Rows) -> None:
    assert segments(drive(bad=bad)) == [slice(*part) for part in parts]


def test_segments_keep_the_time_and_go_by_names_of_their_own() -> None:
    whole = drive(bad=[(500, 900), (910, 1400)])
    found = cut([whole, drive(name="other")])
    assert [record.name for record in found.records] == ["run#1", "run#2", "other"]
    assert found.of(["run"]) == found.records[:2]
    second = found.records[1]
    assert second.time_s[0] == whole.time_s[1400]
    assert second.since_start_s[0] == pytest.approx(14.0)
    assert np.array_equal(second.torque_nm, whole.torque_nm[1400:])
    assert found.warnings == (
        "recording run: gaps of more than 1 s cut it into 3 segments, each with its own initial state and constant "
        "load; 1 of less than 2 s left out; used: 100% of the good samples.",
    )


def test_a_gap_at_an_end_makes_no_other_recording_of_it() -> None:
    found = cut([drive(bad=[(0, 500)])])
    assert [record.name for record in found.records] == ["run"]
    assert found.records[0].time_s[0] == 5.0
    assert found.warnings == ()


@pytest.mark.parametrize(("period_s", "least"), [(0.01, 200), (0.1, Segments.FEWEST_SAMPLES)])
def test_short_segments_are_left_out(period_s: float, least: int) -> None:
    def kept(samples: int) -> list[str]:
        bad = [(samples, 1000)]
        return [record.name for record in cut([replace(drive(bad=bad), sample_time_s=period_s)]).records]

    assert kept(least) == ["run#1", "run#2"]
    assert kept(least - 1) == ["run#1"]


def test_of_a_segment_of_a_part_time_counts_from_the_very_beginning() -> None:
    half = sliced(drive(), slice(1000, 3000))
    quarter = sliced(replace(half, torque_okay=np.ones(2000, dtype=bool), offset_s=np.zeros(2000)), slice(500, 700))
    assert (quarter.began_s, quarter.since_start_s[0]) == (0.0, pytest.approx(15.0))
    assert quarter.offset_s is not None
    assert quarter.torque_okay is not None
    assert quarter.offset_s.shape == quarter.torque_okay.shape == (200,)


def test_a_part_too_short_for_the_noise_is_left_to_the_others() -> None:
    long, short = drive(), sliced(drive(), slice(0, 60))
    assert noise_floor([long, short]) == noise_floor([long])
    assert noise_floor([long, sliced(drive(), slice(0, 10))]) == noise_floor([long])
    with pytest.raises(NotExciting, match="40 samples follow 20 samples of which most are good, expected at least 82"):
        noise_floor([short])


class TestDiagnosis:
    """Thirty seconds with a gap in which the line was braked: simulated through, it would be far off."""

    @pytest.fixture
    def whole(self) -> Record:
        before, after = drive(1400, load_nm=5.0), drive(1400, load_nm=9.0)
        time_s = SAMPLE_TIME_S * np.arange(3000)
        torque = np.concatenate([before.torque_nm, np.full((200, 1), 40.0), after.torque_nm])
        output = np.concatenate([before.output, np.full(200, np.nan), after.output])
        return Record("run", SAMPLE_TIME_S, time_s, torque, output, np.isfinite(output))

    def test_it_is_diagnosed_as_one_recording(self, whole: Record) -> None:
        found = diagnose([whole], LINE)
        assert found.verdict is Verdict.NO_MISMATCH
        assert found.fit.retuned == pytest.approx(0.02, rel=0.1)
        (trace,) = found.traces
        assert trace.name == "run"
        assert np.array_equal(trace.time_s, whole.time_s)
        assert np.array_equal(np.isfinite(trace.retuned), whole.okay)
        assert np.std((trace.retuned - trace.measured)[whole.okay]) < 0.03
        assert list(found.load_torque) == ["run"]
        assert found.load_torque["run"].value == pytest.approx(7.0, abs=0.3)

    def test_its_simulation_begins_anew_behind_the_gap(self, whole: Record) -> None:
        run = replay(LINE, whole)
        assert run.output.shape == whole.time_s.shape
        assert run.rms == pytest.approx(0.02, rel=0.1)


def test_courses_intervals_and_texts_are_joined() -> None:
    """A diagnosis as it could be of two segments, put together from pieces of a real one."""
    whole = drive(bad=[(500, 1500)])
    parts = cut([whole])
    base = diagnose([drive(600, name="run")], LINE)
    course = [Course(r.time_s[:3], np.ones(3), np.zeros(3), 2.0 * np.ones(3)) for r in parts.records]
    profile = [Profile(c.time_s, c.value, c.low, c.high, "Nm") for c in course]
    response = [
        Response(*(np.full(2, float(i)) for _ in range(6)), p_before=1.0, p_after=1.0) for i, _ in enumerate(course)
    ]
    names = [record.name for record in parts.records]
    seen = Discrepancy(
        element=None,
        equivalents=(Equivalent("load", "Nm", dict(zip(names, course, strict=True)), 0.0, True),),
        spectrum=None,  # type: ignore[arg-type]
        responses=dict(zip(names, response, strict=True)),
        pictures=(),
    )
    pieces = replace(
        base,
        statement="a step in run#2, not in run#1",
        mismatch=replace(base.mismatch, time_s={"run#1": ((0.0, 1.0),), "run#2": ((20.0, 21.0), (25.0, 26.0))}),
        load_torque={"run#1": Estimated(1.0, (0.0, 2.0), "Nm"), "run#2": Estimated(5.0, (4.0, 6.0), "Nm")},
        traces=(),
        warnings=("run#2 is odd",),
        discrepancy=seen,
        effects=(),
    )
    result = joined(pieces, parts)
    assert result.statement == "a step in run, not in run"
    assert result.warnings == ("run is odd",)
    assert dict(result.mismatch.time_s) == {"run": ((0.0, 1.0), (20.0, 21.0), (25.0, 26.0))}
    assert result.load_torque["run"].value == pytest.approx(1.0 * 0.25 + 5.0 * 0.75)
    assert result.load_torque["run"].ci95[1] - result.load_torque["run"].value == pytest.approx(np.hypot(0.25, 0.75))
    assert result.discrepancy is not None
    merged = result.discrepancy.equivalents[0].courses["run"]
    assert np.isnan(merged.value[3])
    assert np.all(np.diff(merged.time_s) > 0)
    assert merged.time_s[4] == whole.time_s[1500]
    assert result.discrepancy.responses["run"] is response[1]
    assert profile[0].unit == "Nm"


def lasting(samples: int, name: str = "run") -> Record:
    return record(np.zeros(samples), np.zeros(samples), name=name)


def test_of_what_is_longer_stretches_from_beginning_to_end_are_used() -> None:
    rec = lasting(10 * Noise.MOST_SAMPLES)
    parts = stretches(rec, [slice(0, rec.output.size)], share_of([rec]))
    assert sum(part.stop - part.start for part in parts) == pytest.approx(Noise.MOST_SAMPLES, rel=0.01)
    assert max(part.stop - part.start for part in parts) <= Noise.LONGEST_S / rec.sample_time_s
    assert (parts[0].start, parts[-1].stop) == (0, rec.output.size)
    gaps = [after.start - before.stop for before, after in pairwise(parts)]
    assert min(gaps) > 0
    assert max(gaps) - min(gaps) <= 1


def test_recordings_share_what_may_be_used_by_their_length() -> None:
    found = cut([lasting(3 * Noise.MOST_SAMPLES, "long"), lasting(Noise.MOST_SAMPLES, "short")])
    used = {name: sum(r.output.size for r in found.records if r.name.startswith(name)) for name in ("long", "short")}
    assert used["long"] == pytest.approx(3 * used["short"], rel=0.01)


def test_many_short_recordings_stay_whole() -> None:
    samples = round(0.5 * Noise.LONGEST_S / 0.01)
    records = [lasting(samples, f"run_{i}") for i in range(2 * Noise.MOST_SAMPLES // samples)]
    found = cut(records)
    assert [each.output.size for each in found.records] == [samples] * len(records)
    assert found.warnings == ()


COULOMB: Effects = frozenset({"coulomb_friction_motor"})
SAMPLES = 1200


def with_friction(seeds: tuple[int, ...] = (1, 2)) -> list[Record]:
    return rubbing(lambda speed: 12.0, seeds, SAMPLES)


def fits(records: list[Record], effects: Effects) -> tuple[FitResult, FitResult]:
    bench = Bench(LINE, records, all_good_samples(records))
    return bench.fit(NOTHING), bench.fit(effects, bench.fit(NOTHING))


def test_foreign_recordings_get_their_own_load_and_start_and_nothing_else() -> None:
    records = with_friction()
    _, fitted = fits(records, COULOMB)
    torque = drive_torque(11, SAMPLES)
    elsewhere = linear_record(ONE_MASS, torque, InitialCondition(8.0, 0.0, -4.0), sigma=SIGMA, name="elsewhere")
    (output,) = foreign_outputs(fitted, LINE, [elsewhere], [elsewhere.okay], COULOMB)
    (again,) = foreign_outputs(fitted, model(ONE_MASS, 0.9), [elsewhere], [elsewhere.okay], COULOMB)
    np.testing.assert_array_equal(output, again)
    assert np.std(output - elsewhere.output) > 2.0 * SIGMA  # it has no friction, the fit has
