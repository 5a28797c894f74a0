"""Recordings of a two-mass line, healthy or with one fault of the acquisition, from its modes in closed form.

Independent of the estimator's simulation: between rows the torque is constant, so every mode moves as an exponential
and can be evaluated at any instant, which is what sampling jitter needs.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import lfilter

from estimator.signals.record import BoolArray, FloatArray, Record

PERIOD_S = 0.01
SAMPLES = 3000
NOISE = 0.05
TORQUE_NOISE = 0.5
TORQUE_STEP = 0.6
KINDS = ("cruise", "reversal", "tip")


@dataclass(frozen=True)
class Line:
    """A driveline, states motor speed, twist, load speed; driven by torque less load torque at the load."""

    j_m: float = 1.6
    j_l: float = 95.0
    k: float = 4200.0
    c: float = 9.0
    b_m: float = 0.35
    b_l: float = 0.9
    load_nm: float = 50.0

    def modes(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Eigenvalues, eigenvectors, and the torque's and the load's part in each mode."""
        A = np.array(
            [
                [-(self.c + self.b_m) / self.j_m, -self.k / self.j_m, self.c / self.j_m],
                [1.0, 0.0, -1.0],
                [self.c / self.j_l, self.k / self.j_l, -(self.c + self.b_l) / self.j_l],
            ]
        )
        values, vectors = np.linalg.eig(A)
        parts = np.linalg.inv(vectors)
        return values, vectors, parts @ [1.0 / self.j_m, 0.0, 0.0], parts @ [0.0, 0.0, -self.load_nm / self.j_l]

    def speed(self, torque: FloatArray, start: float, offset_s: FloatArray | float = 0.0) -> FloatArray:
        """Motor speed at ``k PERIOD_S + offset_s[k]`` under a torque held from row to row."""
        values, vectors, drive, load = self.modes()
        offset = np.broadcast_to(np.asarray(offset_s, dtype=float), torque.shape)
        twist = (self.load_nm + self.b_l * start) / self.k
        begin = np.linalg.inv(vectors) @ [start, twist, start]
        out = np.zeros(torque.size, dtype=complex)
        for value, shape, b, b0, z0 in zip(values, vectors[0], drive, load, begin, strict=True):
            push = b * torque + b0
            decay, gain = np.exp(value * PERIOD_S), (np.exp(value * PERIOD_S) - 1.0) / value
            rows = lfilter([0.0, gain], [1.0, -decay], push) + z0 * decay ** np.arange(torque.size)
            base = np.maximum(np.arange(torque.size) - (offset < 0), 0)
            ahead = offset + (np.arange(torque.size) - base) * PERIOD_S
            out += shape * (rows[base] * np.exp(value * ahead) + push[base] * (np.exp(value * ahead) - 1.0) / value)
        return out.real

    def pulse(self, samples: int = SAMPLES) -> FloatArray:
        """Answer of the motor speed to 1 Nm during the first sample."""
        still = replace(self, load_nm=0.0)
        return still.speed(np.eye(1, samples)[0], 0.0)


def prbs(rng: np.random.Generator, amplitude: float, hold: int) -> FloatArray:
    return amplitude * np.repeat(rng.choice([-1.0, 1.0], SAMPLES // hold + 1), hold)[:SAMPLES]


@dataclass(frozen=True)
class Truth:
    """What a healthy acquisition would have read, and the line that did it."""

    line: Line
    torque: FloatArray
    shares: tuple[float, float]
    start: float
    rng: np.random.Generator

    def speed(self, offset_s: FloatArray | float = 0.0) -> FloatArray:
        return self.line.speed(self.torque, self.start, offset_s)

    def record(
        self,
        name: str = "run",
        *,
        speed: FloatArray | None = None,
        decimals: int = 5,
        noise: float = NOISE,
        torque_noise: float = TORQUE_NOISE,
    ) -> Record:
        """Record it: noise on all, torque in steps of its resolution, values rounded to decimals."""
        true = self.speed() if speed is None else speed
        read = true + noise * self.rng.standard_normal(SAMPLES)
        return record(
            np.column_stack([self.read_torque(share, torque_noise) for share in self.shares]), read, name, decimals
        )

    def read_torque(self, share: float, noise: float = TORQUE_NOISE) -> FloatArray:
        noisy = share * self.torque + noise * self.rng.standard_normal(SAMPLES)
        return np.round(noisy / TORQUE_STEP) * TORQUE_STEP


def record(torque: FloatArray, speed: FloatArray, name: str, decimals: int = 5) -> Record:
    n = speed.size
    return Record(
        name,
        PERIOD_S,
        np.arange(n) * PERIOD_S,
        np.round(torque, decimals),
        np.round(speed, decimals),
        np.isfinite(speed),
    )


def drive(kind: str, seed: int) -> Truth:
    """Draw a drive: cruise, reversal through zero, or tip-in and tip-out."""
    rng = np.random.default_rng([seed, KINDS.index(kind)])
    time_s, hold = np.arange(SAMPLES) * PERIOD_S, int(rng.integers(2, 4))
    line = Line(j_m=rng.uniform(1.4, 2.2), k=rng.uniform(3000.0, 5500.0), load_nm=rng.uniform(30.0, 80.0))
    if kind == "cruise":
        start, share = rng.uniform(45.0, 90.0), 0.5
        swell = 40.0 * np.sin(2 * np.pi * time_s / 20.0) + line.load_nm + (line.b_m + line.b_l) * start
        return Truth(line, swell + prbs(rng, rng.uniform(100.0, 130.0), hold), (share, 1 - share), start, rng)
    if kind == "reversal":
        swing = rng.uniform(330.0, 450.0) * np.cos(2 * np.pi * time_s / rng.uniform(10.0, 14.0) - 0.7)
        return Truth(line, swing + prbs(rng, rng.uniform(55.0, 75.0), hold), (0.65, 0.35), 0.0, rng)
    pedal = 190.0 * np.sign(np.sin(2 * np.pi * (time_s / rng.uniform(2.2, 3.0) + rng.random())))
    level = line.load_nm + (line.b_m + line.b_l) * 60.0
    return Truth(line, level + pedal + prbs(rng, rng.uniform(50.0, 65.0), hold), (0.35, 0.65), 60.0, rng)


def drives(seed: int) -> list[Truth]:
    return [drive(kind, seed) for kind in KINDS]


def healthy(seed: int, decimals: int = 5) -> list[Record]:
    return [truth.record(kind, decimals=decimals) for kind, truth in zip(KINDS, drives(seed), strict=True)]


def repeating(values: FloatArray, rows: BoolArray) -> FloatArray:
    """Repeat the value before in the given rows."""
    return values[np.maximum.accumulate(np.where(rows, 0, np.arange(values.size)))]


def random_rows(rng: np.random.Generator, share: float, burst: float = 1.0) -> BoolArray:
    """Rows of a share of the recording, in bursts of a geometric length; never the first."""
    rows = np.zeros(SAMPLES, dtype=bool)
    for begin in np.flatnonzero(rng.random(SAMPLES) < share / burst):
        rows[begin : begin + rng.geometric(1.0 / burst)] = True
    rows[0] = False
    return rows


def periodic_rows(every: int) -> BoolArray:
    rows = np.arange(SAMPLES) % every == every - 1
    return rows


def stale(record: Record, rows: BoolArray, channels: tuple[int, ...]) -> Record:
    """Make channels (0 the speed, 1 and 2 the torques) repeat their last value in the given rows."""
    torque, speed = record.torque_nm.copy(), record.output
    for channel in channels:
        if channel == 0:
            speed = repeating(speed, rows)
        else:
            torque[:, channel - 1] = repeating(torque[:, channel - 1], rows)
    return replace(record, torque_nm=torque, output=speed)
