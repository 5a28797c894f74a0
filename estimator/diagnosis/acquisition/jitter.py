"""Sample jitter: in the time stamps, or in the errors of a converged simulation, whose variance follows the slope."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy import optimize, stats

from estimator.diagnosis.acquisition.finding import OUTPUT, AcquisitionFinding, Sized, no_cells, predict
from estimator.diagnosis.acquisition.quantised import decimal_place
from estimator.diagnosis.thresholds import Findings, Jitter, Noise
from estimator.signals.record import BoolArray, FloatArray, Record, uniform_period_s


def stamp_offsets_s(record: Record) -> FloatArray:
    """Return how far each time stamp is from the uniform time base [s]; zeros where stamps are even, shape (N,)."""
    since = record.time_s - uniform_period_s(record.time_s) * np.arange(record.time_s.size)
    offset: FloatArray = since - since.mean()
    rounding_s = decimal_place(record.time_s) / np.sqrt(12.0)
    smallest = max(Jitter.ABOVE_ROUNDING * rounding_s, Jitter.SMALLEST_PERIODS * record.sample_time_s)
    return offset if float(np.std(offset)) > smallest else np.zeros_like(offset)


def stamped_jitter(records: Sequence[Record]) -> AcquisitionFinding | None:
    """Recognise jitter that stamps tell and the output confirms; None otherwise."""
    offsets = {record.name: stamp_offsets_s(record) for record in records}
    stamped = [record for record in records if offsets[record.name].any()]
    confirmed = [found for record in stamped if (found := _confirmed(record, offsets[record.name])) is not None]
    if not confirmed:
        return None
    agreement, error = _pooled(confirmed)
    p_value = float(stats.norm.sf(agreement / error))
    if p_value > Findings.LEVEL or agreement < Jitter.AGREEMENT:
        return None
    every = np.concatenate([offsets[record.name] for record in stamped])
    jitter_s, n = float(np.std(every)), every.size
    low, high = (jitter_s * float(np.sqrt(n / stats.chi2.ppf(q, n))) for q in (0.975, 0.025))
    cells = {record.name: no_cells(record) for record in records}
    for record in stamped:
        cells[record.name][:, OUTPUT] = True
    return AcquisitionFinding(
        name="sample_jitter",
        parameters={"jitter_s": Sized(jitter_s, (low, high), "s")},
        cells=cells,
        p_value=max(p_value, Noise.SMALLEST_P),
        statement=f"the samples were taken {1e3 * jitter_s:.2g} ms (rms) off their time, as their time stamps show",
    )


def _confirmed(record: Record, offset_s: FloatArray) -> tuple[float, float] | None:
    trusted = record.okay & np.isfinite(record.output)
    trusted[[0, -1]] = False
    trusted[1:-1] &= np.isfinite(record.output[2:]) & np.isfinite(record.output[:-2])
    prediction = predict(record, trusted)
    if prediction is None:
        return None
    slope = np.gradient(np.where(np.isfinite(record.output), record.output, 0.0), record.sample_time_s)
    agreement, error = slope_test((slope * offset_s)[prediction.rows], prediction.error)
    return (agreement, error) if np.isfinite(error) and error > 0.0 else None


def _pooled(found: Sequence[tuple[float, float]]) -> tuple[float, float]:
    """Return the mean of estimates, weighed by their precision, and its standard error."""
    weights = np.array([1.0 / error**2 for _, error in found])
    mean = float(weights @ np.array([value for value, _ in found])) / float(weights.sum())
    return mean, float(1.0 / np.sqrt(weights.sum()))


@dataclass(frozen=True, slots=True)
class _Rest:
    """What is left of the errors of all recordings, with slopes, and the same of the row after; shape (n,)."""

    lengths: tuple[int, ...]
    error: FloatArray
    steepness: FloatArray
    slope: FloatArray
    next_error: FloatArray
    next_slope: FloatArray


def hidden_jitter(
    records: Sequence[Record], errors: Sequence[FloatArray], slopes: Sequence[FloatArray], okay: Sequence[BoolArray]
) -> AcquisitionFinding | None:
    """Recognise jitter in the errors of a simulation that explains everything else."""
    rest = _rests(errors, slopes, okay)
    within = _rests(errors, slopes, okay, Jitter.BLOCK)
    if rest is None or within is None or _likeliest(within.error, within.steepness) is None:
        return None
    p_value = _score_p_value(rest)
    if p_value > Findings.LEVEL:
        return None
    found = _likeliest(rest.error, rest.steepness)
    if found is None or not (_of_the_many(rest, found) and _independent(rest, found)):
        return None
    whole = np.concatenate([error[good] - error[good].mean() for error, good in zip(errors, okay, strict=True)])
    if found.jitter_s**2 * np.mean(rest.steepness**2) < Jitter.MOST_OF_IT * (np.mean(whole**2) - found.noise**2):
        return None
    jitter_s, ci95 = found.jitter_s, found.ci95
    return AcquisitionFinding(
        name="sample_jitter",
        parameters={"jitter_s": Sized(jitter_s, ci95, "s")},
        cells=_outputs(records, okay),
        p_value=max(p_value, Noise.SMALLEST_P),
        statement=f"the samples were taken {1e3 * jitter_s:.2g} ms (rms) off their time, which no time stamp shows",
    )


def mean_shift(slopes: FloatArray, jitter_s: float) -> FloatArray:
    """Return what readings off their time by ``jitter_s`` (rms) are off in the mean: a kink is cut short."""
    return np.sqrt(Jitter.OF_A_KINK) * jitter_s * (slopes[1] - slopes[0])


def _outputs(records: Sequence[Record], okay: Sequence[BoolArray]) -> Mapping[str, BoolArray]:
    cells = {}
    for record, good in zip(records, okay, strict=True):
        cells[record.name] = np.zeros((record.output.size, 1 + record.torque_nm.shape[1]), dtype=np.bool_)
        cells[record.name][:, OUTPUT] = good
    return cells


def _rests(
    errors: Sequence[FloatArray], slopes: Sequence[FloatArray], okay: Sequence[BoolArray], block: int | None = None
) -> _Rest | None:
    """Return the rests of all recordings in a row; None where no recording is long enough."""
    found = [_rest(*data, block) for data in zip(errors, slopes, okay, strict=True)]
    rests = [rest for rest in found if rest is not None]
    fields = ("error", "steepness", "slope", "next_error", "next_slope")
    if not rests:
        return None
    lengths = tuple(length for one in rests for length in one.lengths)
    return _Rest(lengths, *(np.concatenate([getattr(one, name) for one in rests]) for name in fields))


def _rest(error: FloatArray, slopes: FloatArray, okay: BoolArray, block: int | None) -> _Rest | None:
    """Take off what past errors and the slopes around explain, all along or in blocks of so many rows.

    Rows whose surroundings are not okay are left out.
    """
    filled = np.where(okay, error, 0.0)
    width = 2 * Jitter.AROUND + 1
    first, last = Jitter.PAST, error.size - Jitter.AROUND
    if last - first < Jitter.ROWS_IN_ALL * (Jitter.PAST + width):
        return None
    slope, kink = slopes.mean(axis=0), slopes[1] - slopes[0]
    steepness = np.sqrt(np.mean(slopes**2, axis=0) - Jitter.OF_A_KINK * kink**2)
    past = sliding_window_view(filled, Jitter.PAST)[: last - first]
    around = sliding_window_view(slope, width)[first - Jitter.AROUND : last - Jitter.AROUND]
    usable: BoolArray = np.all(sliding_window_view(okay, Jitter.PAST + 1)[: last - first], axis=1)
    if usable.sum() < Jitter.ROWS_PER_COEFFICIENT * (Jitter.PAST + width):
        return None
    regressors = np.column_stack([past, around, kink[first:last], np.ones(last - first)])
    left = np.full(last - first, np.nan)
    blocks = 1 if block is None else max(1, (last - first) // block)
    for stretch in np.array_split(np.arange(last - first), blocks):
        rows = stretch[usable[stretch]]
        if rows.size >= Jitter.ROWS_PER_COEFFICIENT * (Jitter.PAST + width):
            a, now = regressors[rows], filled[first:last][rows]
            left[rows] = now - a @ np.linalg.lstsq(a, now, rcond=None)[0]
    pairs = np.isfinite(left[:-1]) & np.isfinite(left[1:])
    if not pairs.any():
        return None
    this, following = slice(first, last - 1), slice(first + 1, last)
    return _Rest(
        lengths=(int(pairs.sum()),),
        error=left[:-1][pairs],
        steepness=steepness[this][pairs],
        slope=slope[this][pairs],
        next_error=left[1:][pairs],
        next_slope=slope[following][pairs],
    )


def _score_p_value(rest: _Rest) -> float:
    """Test whether the squared error follows the squared slope within the recordings.

    Breusch and Pagan's score test, one-sided, with White's variance (Econometrica 48, 1980): neither noise that differs
    from recording to recording nor a few large errors where the slope is large may pass for it.
    """
    power, drive = (_about_its_mean(signal**2, rest.lengths) for signal in (rest.error, rest.steepness))
    spread = float(np.sqrt((power**2) @ (drive**2)))
    return float(stats.norm.sf(float(power @ drive) / spread)) if spread > 0.0 else 1.0


def _about_its_mean(signal: FloatArray, lengths: tuple[int, ...]) -> FloatArray:
    """Return a signal of all recordings in a row, less its mean in each, shape (n,)."""
    parts = np.split(signal, np.cumsum(lengths)[:-1])
    return np.concatenate([part - part.mean() for part in parts])


@dataclass(frozen=True, slots=True)
class _Jitter:
    jitter_s: float
    ci95: tuple[float, float]
    noise: float


def _likeliest(error: FloatArray, steepness: FloatArray) -> _Jitter | None:
    """Fit both variances by maximum likelihood; the interval is that of the likelihood ratio. None if too small."""

    def cost(logs: FloatArray, jitter: float | None = None) -> float:
        variance = np.exp(2.0 * logs[0]) + (np.exp(2.0 * logs[1]) if jitter is None else jitter**2) * steepness**2
        variance = (
            variance + (Jitter.ROUNDING * size) ** 2
        )  # an error of exactly 0 would be infinitely likely without noise
        return float(np.sum(np.log(variance) + error**2 / variance))

    size, steep = float(np.std(error)), float(np.sqrt(np.mean(steepness**2)))
    if not (size > 0.0 and steep > 0.0):  # nothing varies, or nothing moves: no reading is off its time
        return None
    start = np.array([np.log(size), np.log(0.5 * size / steep)])
    best = optimize.minimize(cost, start, method="Nelder-Mead", options={"xatol": 1e-5, "fatol": 1e-4})
    noise, jitter = (float(value) for value in np.exp(best.x))
    if (jitter * steep) ** 2 < Jitter.LEAST_GAIN * size**2:
        return None

    def excess(log_jitter: float) -> float:
        """Likelihood lost at a jitter, the noise fitted again, less what 95 % allow."""
        bounds = (np.log(size) - 5.0, np.log(size) + 1.0)
        again = optimize.minimize_scalar(
            lambda log_noise: cost(np.array([log_noise, log_jitter])), bounds=bounds, method="bounded"
        )
        least = min(float(again.fun), cost(np.array([best.x[0], log_jitter])))  # where the noise is next to none
        return least - float(best.fun) - float(stats.chi2.ppf(0.95, 1))

    centre = float(best.x[1])
    low, high = (_crossing(excess, centre, centre + side) for side in (-2.0, 2.0))
    return _Jitter(jitter, (float(np.exp(low)), float(np.exp(high))), noise)


def _crossing(excess: Callable[[float], float], inside: float, outside: float) -> float:
    """Return where the likelihood has fallen by what 95 % allow; the outer end where it has not by then."""
    if excess(outside) <= 0.0:
        return outside
    return float(optimize.brentq(excess, min(inside, outside), max(inside, outside), xtol=1e-4))


def _of_the_many(rest: _Rest, found: _Jitter) -> bool:
    steep = rest.steepness >= np.median(rest.steepness)
    mad_to_sigma = 1.0 / float(stats.norm.ppf(0.75))
    typical = (mad_to_sigma * np.median(np.abs(rest.error[steep]))) ** 2
    expected = found.noise**2 + found.jitter_s**2 * float(np.median(rest.steepness[steep] ** 2))
    return bool(typical - found.noise**2 > Jitter.OF_THE_MANY * (expected - found.noise**2))


def _independent(rest: _Rest, found: _Jitter) -> bool:
    """Tell whether rows in a row are off their time independently of each other: those of a clunk or a lag are not."""
    in_common = float((rest.error * rest.slope) @ (rest.next_error * rest.next_slope))
    return abs(in_common) < Jitter.NEIGHBOURS * found.jitter_s**2 * float(rest.slope**2 @ rest.next_slope**2)


def slope_test(signal: FloatArray, error: FloatArray) -> tuple[float, float]:
    """Return the coefficient of a signal in an error and its standard error, robust to unequal variances.

    White's estimator (Econometrica 48, 1980). The standard error is infinite where the signal is nothing.
    """
    power = float(signal @ signal)
    if power <= 0.0:
        return 0.0, float("inf")
    slope = float(signal @ error) / power
    left = error - slope * signal
    return slope, float(np.sqrt(np.sum((signal * left) ** 2))) / power
