"""Active damping: a feedback from motor speed to torque for every line of a region, as a filter of second order.

::

    u = -K(z) y      K(z) = (1 - z^-1) (b0 + b1 z^-1) / (1 + a1 z^-1 + a2 z^-2)

The zero at z = 1 leaves a constant speed alone: the damper neither holds nor brakes the vehicle. Its phase at the
resonance leads by what the dead time takes. The torque is held for a period and acts ``dead_time_s`` after the speed
was sampled. What is judged is the sampled closed loop itself, its poles and its sensitivity ``S = 1 / (1 + K G)``
(Astrom and Wittenmark, Computer-Controlled Systems, 3rd ed., sections 2.3 and 3.3), at every line.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.linalg import expm
from scipy.optimize import minimize

from estimator.errors import BadSetting
from estimator.identification.linear_model import ComplexArray
from estimator.identification.modes.modes import Mode, two_mass_resonance
from estimator.signals.record import FloatArray

LineValues = Mapping[str, float]
"""Values of a two-mass line: J_M, J_L, k, c, b_M, b_L."""

PARAMETERS = ("J_M", "J_L", "k", "c", "b_M", "b_L")
MOST_SENSITIVE = 2.0
CHECKED = 400
"""Random lines of the region a design is checked at, besides its corners."""

ROUNDS = 6
KEEPS_WITHIN = 0.01
"""What the search aims above the damping that is asked, so that it mostly holds at other lines."""


@dataclass(frozen=True, slots=True)
class Region:
    """Lines that are possible: each parameter's value, and its lowest and highest."""

    value: LineValues  # the nominal line
    low: LineValues  # the smallest value of each parameter that is still possible
    high: LineValues  # the largest

    def corners(self) -> Iterator[LineValues]:
        """Yield the nominal line, then every combination of the ends of J_M, J_L, k and c, at the least friction."""
        yield self.value
        ends = [sorted({self.low[name], self.high[name]}) for name in PARAMETERS[:4]]
        yield from (dict(self.low) | dict(zip(PARAMETERS, values, strict=False)) for values in product(*ends))

    def random(self, count: int) -> Iterator[LineValues]:
        """Yield lines from anywhere in it."""
        for draw in np.random.default_rng(1).random((count, len(PARAMETERS))).tolist():
            yield {n: self.low[n] + x * (self.high[n] - self.low[n]) for n, x in zip(PARAMETERS, draw, strict=True)}


@dataclass(frozen=True, slots=True)
class Timing:
    """Period of the feedback, from speed sampled to torque acting, and the torque's time constant [s]."""

    period_s: float  # of the torque's SYNC [s]
    dead_time_s: float  # from the speed sampled to the torque acting [s]
    lag_s: float = 0.0  # time constant of the torque [s]

    @property
    def held(self) -> int:
        """Periods that a torque waits in, begun ones included."""
        return math.ceil(self.dead_time_s / self.period_s - 1e-9)


@dataclass(frozen=True, slots=True, eq=False)
class Filter:
    """K(z): numerator b, denominator a with leading 1 [Nm s/rad]."""

    b: FloatArray  # (n,), highest power of z first [Nm s/rad]
    a: FloatArray  # (n,), the first is 1

    def response(self, z: ComplexArray) -> ComplexArray:
        """Return K at points z."""
        return np.asarray(np.polyval(self.b, z) / np.polyval(self.a, z), dtype=np.complex128)


@dataclass(frozen=True, slots=True)
class Demand:
    """What is asked: least damping, and the most torque [Nm] under an excitation of both inverters together [Nm]."""

    damping: float  # damping ratio that every possible line keeps at least
    limit_nm: float  # most torque of both inverters together [Nm]
    excitation_nm: FloatArray  # (N,), the rig's PRBS of both inverters together [Nm]


@dataclass(frozen=True, slots=True, eq=False)
class Damper:
    """A design that keeps what was asked: its worst of all lines that were tried, their resonances, its torque."""

    filter: Filter  # K(z)
    timing: Timing  # what it was designed for
    line: LineValues  # the nominal line
    least_damping: float  # of the lines that were tried: the smallest damping ratio
    sensitivity: float  # ... the largest peak of the sensitivity function
    region_hz: tuple[float, float]  # ... the lowest and highest resonance [Hz]
    torque_nm: float  # largest torque of the damper at the nominal line under the excitation [Nm]
    n_lines: int  # how many lines were tried


def sampled_line(line: LineValues, timing: Timing) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return (A, B, C) of torque asked to speed, sampled; torques that wait are states of their own, oldest first."""
    J_M, J_L, k, c, b_M, b_L = (line[name] for name in PARAMETERS)
    drift = np.array([[-(c + b_M) / J_M, c / J_M, -k / J_M], [c / J_L, -(c + b_L) / J_L, k / J_L], [1.0, -1.0, 0.0]])
    push = np.array([1.0 / J_M, 0.0, 0.0])
    if timing.lag_s > 0.0:
        drift = np.block([[drift, push[:, None]], [np.zeros((1, 3)), np.full((1, 1), -1.0 / timing.lag_s)]])
        push = np.array([0.0, 0.0, 0.0, 1.0 / timing.lag_s])
    n, held, T = push.shape[0], timing.held, timing.period_s
    late_s = timing.dead_time_s - (held - 1) * T if held else 0.0
    full, new = _driven(drift, push, T), _driven(drift, push, T - late_s)[:n, n]
    AB = np.zeros((n + held, n + held + 1))
    AB[:n, :n] = full[:n, :n]
    AB[:n, n] = full[:n, n] - new  # the oldest torque acts until late_s, then the next one
    AB[:n, n + min(held, 1)] = new
    AB[n:, n + 1 :] = np.eye(held)
    return AB[:, :-1], AB[:, -1], np.eye(n + held)[0]


def _driven(drift: FloatArray, push: FloatArray, duration_s: float) -> FloatArray:
    """Return exp of drift and input together: the motion under a held torque."""
    n = push.shape[0]
    both = np.zeros((n + 1, n + 1))
    both[:n, :n], both[:n, n] = drift, push
    return np.asarray(expm(both * duration_s), dtype=np.float64)


def points(period_s: float, count: int = 160) -> ComplexArray:
    """Return points of the unit circle, 0.5 Hz to just below half the sampling rate."""
    f = np.geomspace(0.5, 0.499 / period_s, count)
    return np.asarray(np.exp(2j * np.pi * f * period_s), dtype=np.complex128)


class Loop:
    """Sampled lines, stacked, that one filter is closed around."""

    def __init__(self, lines: list[LineValues], timing: Timing) -> None:
        A, B, C = zip(*(sampled_line(line, timing) for line in lines), strict=True)
        self.A, self.B, self.C, self.period_s = np.array(A), np.array(B), C[0], timing.period_s
        self.near_hz = open_mode(lines[0]).frequency_hz
        self._z = points(timing.period_s)
        self._G = self.response(self._z)

    def response(self, z: ComplexArray) -> ComplexArray:
        """Return torque to speed of each line at points z, (lines, points)."""
        n = self.A.shape[1]
        solved = np.linalg.solve(
            z[None, :, None, None] * np.eye(n) - self.A[:, None],
            np.broadcast_to(self.B[:, None, :, None], (self.A.shape[0], z.shape[0], n, 1)),
        )
        return np.asarray(solved[..., 0] @ self.C, dtype=np.complex128)

    def closed(self, K: Filter) -> FloatArray:
        """Return the closed loops' matrices: lines, then the filter's two states (transposed direct form II)."""
        m, n, _ = self.A.shape
        out = np.zeros((m, n + 2, n + 2))
        out[:, :n, :n] = self.A - K.b[0] * self.B[:, :, None] * self.C
        out[:, :n, n] = -self.B
        for i in (0, 1):
            out[:, n + i, :n] = (K.b[i + 1] - K.a[i + 1] * K.b[0]) * self.C
            out[:, n + i, n] = -K.a[i + 1]
        out[:, n, n + 1] = 1.0
        return out

    def modes(self, K: Filter) -> tuple[FloatArray, FloatArray]:
        """Return frequency [Hz] and damping of each line's least damped pair near the resonance; unstable: below 0.

        Near is from a third to three times its frequency.
        """
        z = np.linalg.eigvals(self.closed(K)).astype(np.complex128)
        s = np.log(np.where(z.imag > 0.0, z, 0.5)) / self.period_s
        hz, largest = np.abs(s) / (2.0 * np.pi), np.max(np.abs(z), axis=1)
        near = (z.imag > 0.0) & (hz > self.near_hz / 3.0) & (hz < self.near_hz * 3.0)
        damping = np.where(near, -s.real / np.abs(s), 1.0)
        first = np.argmin(damping, axis=1)[:, None]
        hz, damping = (np.take_along_axis(each, first, axis=1)[:, 0] for each in (hz, damping))
        return hz, np.where(largest > 1.0 + 1e-9, -largest, damping)

    def sensitivity(self, K: Filter) -> FloatArray:
        """Return the peak of |S| of each line."""
        return np.asarray(np.max(1.0 / np.abs(1.0 + K.response(self._z) * self._G), axis=1), dtype=np.float64)


def filter_of(settings: FloatArray, at_hz: float, period_s: float) -> Filter:
    """Return the filter: log gain and lead [rad] at a frequency, log ratio of its own frequency to it, its damping."""
    gain, lead, ratio, damping = math.exp(settings[0]), settings[1], math.exp(settings[2]), settings[3]
    turn = 2.0 * np.pi * at_hz * period_s
    split = np.sqrt(complex(damping**2 - 1.0))
    a = np.asarray(
        np.poly(np.exp(turn * ratio * np.array([-damping + split, -damping - split]))).real, dtype=np.float64
    )
    z = np.exp(1j * turn)
    wanted = gain * np.exp(1j * lead) * np.polyval(a, z) / (z * (z - 1.0))  # of b0 + b1 / z
    b1 = -wanted.imag / math.sin(turn)
    b0 = wanted.real - b1 * math.cos(turn)
    return Filter(np.array([b0, b1 - b0, -b1]), a)


class _Search:
    """What a filter comes to at some lines, the nominal one first."""

    def __init__(self, lines: list[LineValues], timing: Timing, demand: Demand) -> None:
        self.loop, self.demand, self.lines = Loop(lines, timing), demand, lines
        count = demand.excitation_nm.shape[0]
        self._turn = np.exp(2j * np.pi * np.arange(1, count // 2 + 1) / count)
        self._asked = Loop(lines[:1], timing).response(self._turn)[0]

    def filter(self, settings: FloatArray) -> Filter:
        return filter_of(settings, self.loop.near_hz, self.loop.period_s)

    def torque_nm(self, K: Filter) -> float:
        """Return the most the damper gives at the nominal line under the excitation, repeated for ever [Nm]."""
        if not self._turn.size:
            return 0.0
        through = K.response(self._turn) * self._asked
        spectrum = np.fft.rfft(self.demand.excitation_nm)
        spectrum[0], spectrum[1:] = 0.0, spectrum[1:] * through / (1.0 + through)
        return float(np.max(np.abs(np.fft.irfft(spectrum, self.demand.excitation_nm.shape[0]))))

    def comes_to(self, K: Filter) -> tuple[float, float, float]:
        """Return least damping, largest sensitivity, and torque."""
        return float(np.min(self.loop.modes(K)[1])), float(np.max(self.loop.sensitivity(K))), self.torque_nm(K)

    def holds(self, K: Filter) -> bool:
        damping, peak, torque_nm = self.comes_to(K)
        return damping >= self.demand.damping and peak <= MOST_SENSITIVE and torque_nm <= self.demand.limit_nm

    def missing(self, settings: FloatArray) -> float:
        """Return by how much it fails what is asked; below that, how large its gain is: the least that does is best."""
        if not (0.1 <= settings[3] <= 2.0 and abs(settings[2]) < 1.5):
            return 1e3
        damping, peak, torque_nm = self.comes_to(self.filter(settings))
        lacks = (
            max(self.demand.damping + KEEPS_WITHIN - damping, 0.0) / self.demand.damping
            + max(peak / (0.98 * MOST_SENSITIVE) - 1.0, 0.0)
            + max(torque_nm / (0.99 * self.demand.limit_nm) - 1.0, 0.0)
        )
        return lacks if lacks > 0.0 else -1.0 / (1.0 + math.exp(settings[0]))

    def best(self) -> Filter:
        """Search from two leads, for short and for long dead times."""
        gain = 4.0 * np.pi * self.loop.near_hz * self.demand.damping * self.lines[0]["J_M"]
        tried = [
            minimize(self.missing, [math.log(gain), lead, 0.3, 0.8], method="Nelder-Mead", options={"maxfev": 250})
            for lead in (0.5, 1.1)
        ]
        return self.filter(min(tried, key=lambda each: each.fun).x)


def open_mode(line: LineValues) -> Mode:
    """Return a line's own resonance."""
    mode = two_mass_resonance(**line)
    if mode is None:
        raise BadSetting("damper: the line has no resonance that oscillates, expected one to be damped.")
    return mode


def design_damper(region: Region, timing: Timing, demand: Demand) -> Damper:
    """Design the damper of least gain that does what is asked at every line of a region, or say what is in the way."""
    try:
        with np.errstate(over="ignore", divide="ignore", invalid="ignore"):  # such a filter is not chosen
            return _designed(region, timing, demand)
    except (np.linalg.LinAlgError, ArithmeticError) as error:
        said = ", ".join(f"{name} = {value:g}" for name, value in region.value.items())
        raise BadSetting(
            f"damper: expected a line that can be computed with, got values too far apart for it: {said}."
        ) from error


def _designed(region: Region, timing: Timing, demand: Demand) -> Damper:
    lines, others = list(region.corners()), [region.value, *region.random(CHECKED)]
    _require_seen([*lines, *others], timing)
    check = _Search(others, timing, demand)
    for _ in range(ROUNDS):
        search = _Search(lines, timing, demand)
        K = search.best()
        if not search.holds(K):
            raise _refused(_obstacle(region, timing, demand, search.comes_to(K)))
        if check.holds(K):
            break
        lines.append(others[int(np.argmin(check.loop.modes(K)[1]))])
        lines.append(others[int(np.argmax(check.loop.sensitivity(K)))])
    else:
        raise _refused("the search: it came to no filter that holds between the corners of the region")
    dampings, peaks, torques_nm = zip(search.comes_to(K), check.comes_to(K), strict=True)
    open_hz = [open_mode(line).frequency_hz for line in (*lines, *others)]
    return Damper(
        filter=K,
        timing=timing,
        line=region.value,
        least_damping=min(dampings),
        sensitivity=max(peaks),
        region_hz=(min(open_hz), max(open_hz)),
        torque_nm=max(torques_nm),
        n_lines=len(lines) + CHECKED,
    )


def _require_seen(lines: list[LineValues], timing: Timing) -> None:
    """Refuse a region with a resonance at or beyond half the sampling rate, where a sampled speed shows another one."""
    highest_hz, most_hz = max(open_mode(line).frequency_hz for line in lines), 0.5 / timing.period_s
    if not highest_hz < most_hz:
        raise BadSetting(
            f"damper: the region has a resonance of {highest_hz:.4g} Hz, expected less than {most_hz:.4g} Hz, half the "
            f"sampling rate at a period of {timing.period_s * 1e3:g} ms. Know the line better, or sample faster."
        )


def _obstacle(region: Region, timing: Timing, demand: Demand, best: tuple[float, float, float]) -> str:
    """Say what is in the way: what a search would reach without it."""
    corners, nominal = list(region.corners()), [region.value]
    easier = {
        f"the torque: {demand.limit_nm:.0f} Nm is not enough under this excitation": (
            _Search(corners, timing, Demand(demand.damping, math.inf, demand.excitation_nm))
        ),
        "the uncertainty: the nominal line alone could be damped. Know the line better": (
            _Search(nominal, timing, demand)
        ),
        f"the dead time: {timing.dead_time_s * 1e3:.1f} ms and a lag of {timing.lag_s * 1e3:.1f} ms": (
            _Search(nominal, Timing(timing.period_s, 0.0), demand)
        ),
    }
    last = f"the period of {timing.period_s * 1e3:g} ms and this target"
    return (
        f"{next((why for why, search in easier.items() if search.holds(search.best())), last)}; the best found has "
        f"damping {best[0]:.3f} in the worst line, a sensitivity of {best[1]:.2f} and takes {best[2]:.0f} Nm"
    )


def _refused(why: str) -> BadSetting:
    return BadSetting(f"damper: no filter does what is asked at every line of the region. In the way is {why}.")
