"""Buses of the benchmarks' own on rough roads, with a driver: written from masses, dampers and springs alone.

Nothing of ``estimator``, ``hil.simulator`` or ``hil.proof`` is imported here.
"""

import math
from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm
from scipy.signal import lfilter

from estimator.signals.record import Record

Array = NDArray[np.float64]

MOTOR, LOAD = 0, 1
STATES = 4
"""Two angles [rad], two speeds [rad/s]."""


@dataclass(frozen=True, slots=True)
class Line:
    """Inertias [kg m^2], stiffness [Nm/rad], damping and friction [Nm s/rad], reflected to the motor shaft.

    ``b_L`` is all that slows the load in proportion to its speed: bearings, and the slope of the air's drag.
    """

    J_M: float
    J_L: float
    k: float
    c: float
    b_M: float
    b_L: float

    @property
    def parameters(self) -> dict[str, float]:
        """All six by name."""
        return {name: getattr(self, name) for name in ("J_M", "J_L", "k", "c", "b_M", "b_L")}

    def system(self) -> tuple[Array, Array]:
        """Return F, G of ``x' = F x + G (motor torque, load torque)`` with x = angles and speeds, (4, 4) and (4, 2)."""
        between = np.array([[1.0, -1.0], [-1.0, 1.0]])
        stiffness, damping = self.k * between, self.c * between + np.diag([self.b_M, self.b_L])
        compliance = np.diag([1.0 / self.J_M, 1.0 / self.J_L])
        F = np.block([[np.zeros((2, 2)), np.eye(2)], [-compliance @ stiffness, -compliance @ damping]])
        G = np.vstack([np.zeros((2, 2)), compliance @ np.diag([1.0, -1.0])])
        return F, G

    def held(self, period_s: float) -> tuple[Array, Array]:
        """Return the state's move over a period [s] in which both torques are held, (4, 4) and (4, 2)."""
        F, G = self.system()
        augmented = np.zeros((STATES + 2, STATES + 2))
        augmented[:STATES, :STATES], augmented[:STATES, STATES:] = F, G
        moved = expm(period_s * augmented)
        return moved[:STATES, :STATES], moved[:STATES, STATES:]

    def resonance(self) -> tuple[float, float]:
        """Return natural frequency ``|s| / 2 pi`` [Hz] and damping ratio ``-Re s / |s|`` of the oscillating pair."""
        poles = np.linalg.eigvals(self.system()[0])
        s = complex(poles[int(np.argmax(poles.imag))])
        return abs(s) / (2.0 * math.pi), -s.real / abs(s)


METRES_PER_RAD = 0.48 / 5.6
"""Wheel radius over gear ratio: metres driven per radian of the motor."""

AIR_KG_M3, DRAG_AREA_M2 = 1.2, 5.0
"""c_d A of a city bus: 0.65 times some 7.7 m^2 of front."""


@dataclass(frozen=True, slots=True)
class Road:
    """What the load torque varies with."""

    roughness_m3: float
    grade_nm: float
    gust_nm: float


@dataclass(frozen=True, slots=True)
class Driver:
    """Who holds the speed."""

    reading_s: float
    reaction_s: float
    pedal_s: float
    bandwidth_rad_s: float


@dataclass(frozen=True, slots=True)
class Bus:
    """A bus on its way."""

    seed: int
    line: Line
    speed_rad_s: float
    share: float
    prbs_nm: float
    ripple_nm: float
    noise_rad_s: float
    road: Road
    driver: Driver

    @property
    def speed_m_s(self) -> float:
        """Speed on the road [m/s]."""
        return self.speed_rad_s * METRES_PER_RAD

    @property
    def mass_kg(self) -> float:
        """The mass that is the load's inertia [kg]."""
        return self.line.J_L / METRES_PER_RAD**2


def draw_bus(seed: int) -> Bus:
    """Return the bus of a seed."""
    rng = np.random.default_rng([37, seed])
    speed_rad_s = float(rng.uniform(65.0, 125.0))
    line = _draw_line(rng, speed_rad_s)
    return Bus(
        seed=seed,
        line=line,
        speed_rad_s=speed_rad_s,
        share=float(rng.uniform(0.4, 0.6)),
        prbs_nm=float(rng.uniform(15.0, 60.0)),
        ripple_nm=float(rng.uniform(0.2, 0.5)),
        noise_rad_s=float(rng.uniform(0.02, 0.05)),
        road=Road(
            roughness_m3=1e-6 * float(np.exp(rng.uniform(math.log(4.0), math.log(128.0)))),
            grade_nm=float(rng.uniform(10.0, 60.0)),
            gust_nm=float(rng.uniform(3.0, 15.0)),
        ),
        driver=_draw_driver(rng),
    )


def _draw_driver(rng: np.random.Generator) -> Driver:
    """Return a driver whose loop crosses over where its lags together take 11 to 23 degrees of phase."""
    reading_s, reaction_s, pedal_s = (float(rng.uniform(*ends)) for ends in ((0.2, 0.5), (0.3, 1.0), (0.15, 0.5)))
    bandwidth_rad_s = float(rng.uniform(0.2, 0.4)) / (reading_s + reaction_s + pedal_s)
    return Driver(reading_s, reaction_s, pedal_s, bandwidth_rad_s)


def _draw_line(rng: np.random.Generator, speed_rad_s: float) -> Line:
    """Return the line whose resonance and damping are near what is drawn; friction has its small part in both."""
    J_M, J_L = float(rng.uniform(1.2, 2.2)), float(rng.uniform(70.0, 140.0))
    omega, zeta = 2.0 * math.pi * float(rng.uniform(5.0, 12.0)), float(rng.uniform(0.02, 0.10))
    b_M, b_bearings = float(rng.uniform(0.05, 0.4)), float(rng.uniform(0.2, 1.2))
    drag = AIR_KG_M3 * DRAG_AREA_M2 * speed_rad_s * METRES_PER_RAD**3
    joint = J_M * J_L / (J_M + J_L)
    c = joint * (2.0 * zeta * omega - b_M / J_M)
    return Line(J_M, J_L, k=joint * omega**2, c=c, b_M=b_M, b_L=b_bearings + drag)


class Foot:
    """Proportional and integral action on the speed read a reaction time ago, through foot and pedal.

    The load alone, ``1 / J s`` with all inertia, is what the driver feels: the gain is crossover times inertia, and
    the integral has a tenth of the crossover's speed. Two lags, of the reading and of the pedal, keep the foot off the
    resonance, where the speed of the motor answers a torque much more than ``1 / J s`` says.
    """

    def __init__(self, bus: Bus, torque_nm: float, period_s: float) -> None:
        driver, inertia = bus.driver, bus.line.J_M + bus.line.J_L
        self._gain = driver.bandwidth_rad_s * inertia
        self._integral_gain = self._gain * driver.bandwidth_rad_s / 10.0 * period_s
        self._reading_share = period_s / (driver.reading_s + period_s)
        self._pedal_share = period_s / (driver.pedal_s + period_s)
        self._target = self._shown = bus.speed_rad_s
        self._seen = deque([bus.speed_rad_s] * max(round(driver.reaction_s / period_s), 1))
        self._held_nm = self._pedal_nm = torque_nm

    def torque_nm(self, speed_rad_s: float) -> float:
        """Return the torque that is asked for after one more reading of the speed [Nm]."""
        self._shown += self._reading_share * (speed_rad_s - self._shown)
        self._seen.append(self._shown)
        short = self._target - self._seen.popleft()
        self._held_nm += self._integral_gain * short
        self._pedal_nm += self._pedal_share * (self._held_nm + self._gain * short - self._pedal_nm)
        return self._pedal_nm


GRAVITY_M_S2 = 9.80665
REFERENCE_PER_M = 0.1
PATCH_M = 0.15
"""Distance after which a tyre has forgotten a step of the slope [m]."""

WHEELBASE_M, FRONT_SHARE = 6.0, 0.36
"""Of a solo bus of 12 m."""

HILLS_M = (70.0, 110.0, 180.0, 290.0)
"""Mean lengths of the rises and falls; each is drawn within a fifth of it."""

GUST_S = 3.0


def load_torque(bus: Bus, n: int, step_s: float, rng: np.random.Generator) -> Array:
    """Return what varies of the load torque at the motor shaft, shape (n,), every ``step_s`` [Nm]."""
    return surface(bus, n, step_s, rng) + hills(bus, n, step_s, rng) + gusts(bus, n, step_s, rng)


def surface(bus: Bus, n: int, step_s: float, rng: np.random.Generator) -> Array:
    """Return the torque that the rough surface takes, shape (n,) [Nm]."""
    step_m = bus.speed_m_s * step_s
    behind = round(WHEELBASE_M / step_m)
    slope_density_m = (2.0 * math.pi * REFERENCE_PER_M) ** 2 * bus.road.roughness_m3
    slope = rng.normal(0.0, math.sqrt(slope_density_m / (2.0 * step_m)), n + behind)
    both = FRONT_SHARE * slope[behind:] + (1.0 - FRONT_SHARE) * slope[:n]
    kept = math.exp(-step_m / PATCH_M)
    weight_nm = bus.mass_kg * GRAVITY_M_S2 * METRES_PER_RAD
    return np.asarray(weight_nm * lfilter([1.0 - kept], [1.0, -kept], both), dtype=np.float64)


def hills(bus: Bus, n: int, step_s: float, rng: np.random.Generator) -> Array:
    """Return the torque that the grade takes: sines that share the power in a drawn proportion, shape (n,) [Nm]."""
    way_m = bus.speed_m_s * step_s * np.arange(n)
    shares = np.sqrt(rng.dirichlet(np.ones(len(HILLS_M))))
    lengths_m = np.array(HILLS_M) * rng.uniform(0.8, 1.2, len(HILLS_M))
    phases = rng.uniform(0.0, 2.0 * math.pi, len(HILLS_M))
    waves = np.sin(2.0 * math.pi * way_m[:, np.newaxis] / lengths_m + phases)
    return np.asarray(math.sqrt(2.0) * bus.road.grade_nm * waves @ shares, dtype=np.float64)


def gusts(bus: Bus, n: int, step_s: float, rng: np.random.Generator) -> Array:
    """Return the torque that gusts take: a first-order Markov process, shape (n,) [Nm]."""
    kept = math.exp(-step_s / GUST_S)
    pushes = rng.normal(0.0, bus.road.gust_nm * math.sqrt(1.0 - kept**2), n)
    pushes[0] /= math.sqrt(1.0 - kept**2)  # as strong from the beginning on
    return np.asarray(lfilter([1.0], [1.0, -kept], pushes), dtype=np.float64)


PERIOD_S = 0.01
ROAD_STEPS = 10
COUNT_NM = 0.6
"""0.1 % of an inverter's rated 600 Nm."""

SETTLING_S = 20.0
"""Driven before the recording begins: the driver has found the torque by then."""

ROLLING_NM = 80.0
"""Constant part of the load torque at the motor [Nm]: 0.8 to 1 % of a bus's weight."""

CELLS, TAPS = 10, (10, 7)
"""Of the shift register: x^10 + x^7 + 1 is primitive, so that it repeats after 1023 steps."""


@dataclass(frozen=True, slots=True)
class World:
    """What of the world there is around the line."""

    road: bool = True
    driver: bool = True


ON_THE_ROAD, CLEAN = World(), World(road=False, driver=False)


def drive(bus: Bus, seconds: float = 30.0, seed: int = 0, world: World = ON_THE_ROAD) -> Record:
    """Drive a bus and return the recording at 10 ms."""
    rng = np.random.default_rng([bus.seed, seed])
    kept, settling = round(seconds / PERIOD_S), round(SETTLING_S / PERIOD_S)
    n = kept + settling
    half_prbs_nm = 0.5 * bus.prbs_nm * prbs(n, int(rng.integers(1, 2**CELLS)))
    ripple_nm = rng.normal(0.0, bus.ripple_nm, (n, 2))
    noise = rng.normal(0.0, bus.noise_rad_s, n)
    pushes = _load_moves(bus, n, rng, world)
    held_nm = (bus.line.b_M + bus.line.b_L) * bus.speed_rad_s + ROLLING_NM
    foot = Foot(bus, held_nm, PERIOD_S)
    A, B = bus.line.held(PERIOD_S)
    x, torque, speed = _rolling(bus, held_nm), np.empty((n, 2)), np.empty(n)
    shares = np.array([bus.share, 1.0 - bus.share])
    for row in range(n):
        speed[row] = x[2 + MOTOR] + noise[row]
        asked_nm = foot.torque_nm(float(speed[row])) if world.driver else held_nm
        torque[row] = in_counts(asked_nm * shares + half_prbs_nm[row]) + ripple_nm[row]
        x = A @ x + B[:, MOTOR] * torque[row].sum() + pushes[row]
    time_s: Array = PERIOD_S * np.arange(kept, dtype=np.float64)
    readings, okay = in_counts(torque[settling:]), np.ones(kept, dtype=np.bool_)
    return Record(f"bus_{bus.seed}_{seed}", PERIOD_S, time_s, readings, speed[settling:], okay)


def in_counts(torque_nm: Array) -> Array:
    """Return torques as an inverter's object holds them: whole counts [Nm]."""
    return np.asarray(COUNT_NM * np.round(torque_nm / COUNT_NM), dtype=np.float64)


def prbs(n: int, state: int) -> Array:
    """Return n values of +1 and -1 of the ten-cell shift register from a state that is not 0."""
    values = np.empty(n)
    for i in range(n):
        values[i] = 1.0 if state & 1 else -1.0
        fed_back = (state >> (CELLS - TAPS[0]) ^ state >> (CELLS - TAPS[1])) & 1
        state = state >> 1 | fed_back << (CELLS - 1)
    return values


def _rolling(bus: Bus, held_nm: float) -> Array:
    """Return the state of steady rolling: the shaft twisted by what the load takes."""
    x = np.zeros(STATES)
    x[MOTOR] = (held_nm - bus.line.b_M * bus.speed_rad_s) / bus.line.k
    x[2:] = bus.speed_rad_s
    return x


def _load_moves(bus: Bus, n: int, rng: np.random.Generator, world: World) -> Array:
    """Return what the load torque adds to the state in each period, shape (n, 4)."""
    step_s = PERIOD_S / ROAD_STEPS
    load_nm = np.full((n, ROAD_STEPS), ROLLING_NM)
    if world.road:
        load_nm += load_torque(bus, n * ROAD_STEPS, step_s, rng).reshape(n, ROAD_STEPS)
    A, B = bus.line.held(step_s)
    moves = np.empty((ROAD_STEPS, STATES))
    move = B[:, LOAD]
    for step in reversed(range(ROAD_STEPS)):
        moves[step] = move
        move = A @ move
    return np.asarray(load_nm @ moves, dtype=np.float64)
