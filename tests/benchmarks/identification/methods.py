"""Methods that identify a bus: this project's as a user calls them, and other tools on the same arrays."""

import contextlib
import importlib
import importlib.util
import io
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import toeplitz
from scipy.optimize import least_squares
from scipy.signal import butter, lfilter, lfilter_zi

from estimator.errors import BadModel, EstimatorError
from estimator.identification.best import best_estimate
from estimator.identification.chain import OnlineChain
from estimator.identification.identify import identify
from estimator.identification.modes.modes import Mode, Uncertain, UncertainMode
from estimator.identification.modes.physical import physical_parameters
from estimator.identification.offline.fits import LinearFit
from estimator.identification.settings import Settings
from estimator.signals.record import Record
from tests.benchmarks.buses import PERIOD_S, Array, Bus, World, draw_bus, drive
from tests.estimator.identification.driveline import uncertain_resonance

HIGH_PASS_HZ = 0.3
BAND_HZ = (2.0, 25.0)
LIGHTLY_DAMPED = 0.5
"""From this damping ratio on a pair is no resonance."""

SECONDS = 30.0


@dataclass(frozen=True, slots=True, eq=False)
class Case:
    """One bus and its cruise: as recorded, and high-passed for whoever takes plain arrays."""

    bus: Bus
    record: Record
    u: Array
    y: Array

    @property
    def truth(self) -> dict[str, float]:
        """What is looked for, by name."""
        frequency_hz, damping = self.bus.line.resonance()
        return {"frequency": frequency_hz, "damping": damping, **self.bus.line.parameters}


def make_case(seed: int, world: World) -> Case:
    """Drive the bus of a seed."""
    bus = draw_bus(seed)
    record = drive(bus, SECONDS, world=world)
    return Case(bus, record, high_passed(record.torque_nm.sum(axis=1)), high_passed(record.output))


def high_passed(x: Array) -> Array:
    """Return a signal without its slow part, from the mean of its first second on."""
    b, a = butter(1, HIGH_PASS_HZ, "highpass", fs=1.0 / PERIOD_S)
    begin = x[: round(1.0 / PERIOD_S)].mean()
    return np.asarray(lfilter(b, a, x, zi=lfilter_zi(b, a) * begin)[0], dtype=np.float64)


@dataclass(frozen=True, slots=True)
class Interval:
    """A printed estimate: value, 95 % interval, and whether it is called determined."""

    value: float
    low: float
    high: float
    is_determined: bool = True

    def holds(self, truth: float) -> bool:
        """Tell whether the interval holds the truth."""
        return self.low <= truth <= self.high


@dataclass(frozen=True, slots=True)
class Answer:
    """What a method says: resonance [Hz] and damping ratio, NaN where it has none; what it prints with intervals; why.

    ``cpu_s`` is the processor time of the method alone [s].
    """

    frequency_hz: float = math.nan
    damping: float = math.nan
    intervals: Mapping[str, Interval] = field(default_factory=dict)
    refusal: str = ""
    cpu_s: float = math.nan

    @property
    def is_there(self) -> bool:
        """Tell whether there is a resonance in it."""
        return math.isfinite(self.frequency_hz) and math.isfinite(self.damping)


Method = Callable[[Case], Answer]


def of_poles(poles: Array) -> Answer:
    """Return the least damped pair in the band as an answer; poles in z at the recordings' period."""
    z = np.asarray(poles, dtype=np.complex128)
    s = np.log(z[z.imag > 0.0]) / PERIOD_S
    frequency_hz, damping = np.abs(s) / (2.0 * math.pi), -s.real / np.abs(s)
    low, high = BAND_HZ
    there = (frequency_hz > low) & (frequency_hz < high) & (damping > 0.0) & (damping < LIGHTLY_DAMPED)
    if not there.any():
        return Answer(refusal="no lightly damped pair of poles in the band")
    at = int(np.argmin(np.where(there, damping, np.inf)))
    return Answer(float(frequency_hz[at]), float(damping[at]))


ORDER, NOISE_ORDER, TURNS = 3, 50, 8
OUTSIDE = 1e3
"""Error at an unstable trial, so that the step is refused."""


def box_jenkins(u: Array, y: Array) -> Array:
    """Return the poles in z of the model between u and y."""
    theta = _start(u, y)
    for _ in range(TURNS):
        v = y - lfilter(*_polynomials(theta), u)
        D = np.concatenate([[1.0], -_regression(_past(v, NOISE_ORDER), v)])
        filtered = lfilter(D, [1.0], u), lfilter(D, [1.0], y)
        before, theta = theta, least_squares(_error, theta, x_scale=np.abs(theta) + 1e-9, args=filtered).x
        if np.allclose(theta, before, rtol=1e-6):
            break
    return np.roots(_polynomials(theta)[1])


def _start(u: Array, y: Array) -> Array:
    whitening = np.concatenate([[1.0], -_regression(np.hstack([_past(y, NOISE_ORDER), _past(u, NOISE_ORDER)]), y)])
    u, y = (lfilter(whitening[: NOISE_ORDER + 1], [1.0], x) for x in (u, y))
    theta = np.zeros(2 * ORDER)
    for _ in range(TURNS):
        a = _polynomials(theta)[1]
        u_a, y_a = lfilter([1.0], a, u), lfilter([1.0], a, y)
        theta = _regression(np.hstack([-_past(y_a, ORDER), _past(u_a, ORDER)]), y_a)
        poles = np.roots(_polynomials(theta)[1])
        theta[:ORDER] = np.real(np.poly(np.where(np.abs(poles) < 1.0, poles, 1.0 / poles.conj())))[1:]
    return theta


def _regression(past: Array, x: Array) -> Array:
    """Return the coefficients of x on its past, without the samples at the beginning that have none."""
    return np.linalg.lstsq(past[NOISE_ORDER:], x[NOISE_ORDER:], rcond=None)[0]


def _past(x: Array, lags: int) -> Array:
    """Return the columns x(t-1) to x(t-lags), shape (N, lags)."""
    return toeplitz(np.concatenate([[0.0], x[:-1]]), np.zeros(lags))


def _polynomials(theta: Array) -> tuple[Array, Array]:
    """Return B and A in q^-1."""
    return np.concatenate([[0.0], theta[ORDER:]]), np.concatenate([[1.0], theta[:ORDER]])


def _error(theta: Array, u: Array, y: Array) -> Array:
    b, a = _polynomials(theta)
    error = y - lfilter(b, a, u) if np.abs(np.roots(a)).max() < 1.0 else np.full(y.shape, OUTSIDE)
    return error[NOISE_ORDER:]


BEST, BATCH, RECURSIVE, TRACKED = "Box-Jenkins, 10 ms", "output error, 10 ms", "OEFO, 20 ms", "OEFO, tracked"


def printed(estimate: Uncertain) -> Interval:
    """Return an estimate as it is printed."""
    return Interval(estimate.value, *estimate.ci95, estimate.is_determined)


def of_mode(mode: UncertainMode | None, others: dict[str, Interval] | None = None) -> Answer:
    """Return a resonance with intervals as an answer."""
    if mode is None:
        return Answer(intervals=others or {}, refusal="no resonance")
    intervals = {"frequency": printed(mode.frequency_hz), "damping": printed(mode.damping)}
    return Answer(mode.frequency_hz.value, mode.damping.value, intervals | (others or {}))


def best(case: Case) -> Answer:
    """Return the best off-line estimate, at the recording's own period, and the two-mass drive behind it."""
    found = best_estimate(case.record)
    return of_mode(found.mode, _physical(found.two_mass))


def _physical(fit: LinearFit) -> dict[str, Interval]:
    try:
        found = physical_parameters(fit.model, fit.covariance)
    except BadModel:
        return {}
    both = {**found.parameters, **found.sums}
    return {name: printed(parameter.estimate) for name, parameter in both.items()}


def batch(case: Case) -> Answer:
    """Return the output-error model."""
    fit = identify(case.record).batch
    return of_mode(uncertain_resonance(fit.model, fit.covariance))


def recursive(case: Case) -> Answer:
    """Return the on-line model after the run, N = 1024."""
    return _of_mode(identify(case.record).online_resonance)


def _of_mode(mode: Mode | None) -> Answer:
    return Answer(refusal="no resonance") if mode is None else Answer(mode.frequency_hz, mode.damping)


def tracked(case: Case) -> Answer:
    """Return the resonance that is followed while driving, at the end of the run, with its intervals."""
    chain = OnlineChain(Settings(), case.record.sample_time_s, identify(case.record).L)
    last = chain.run(case.record)[-1]
    if last.resonance is None:
        return Answer(refusal="no resonance")
    mode = last.resonance
    return of_mode(
        UncertainMode(Uncertain(mode.frequency_hz, last.frequency_std_hz), Uncertain(mode.damping, last.damping_std))
    )


def refusing(method: Method) -> Method:
    """Return the method with its refusals as answers."""

    def answer(case: Case) -> Answer:
        try:
            return method(case)
        except EstimatorError as refusal:
            return Answer(refusal=f"{type(refusal).__name__}: {refusal}")

    return answer


OURS = {BEST: refusing(best), BATCH: refusing(batch), RECURSIVE: refusing(recursive), TRACKED: refusing(tracked)}


HORIZON = 20
"""Block rows of the subspace methods [samples]: SIPPY's default, a period of the slowest resonance."""

MARKOV = 200
"""Parameters of the impulse response: 2 s, in which the least damped resonance has died."""

Poles = Callable[[Array, Array], Array]


@dataclass(frozen=True, slots=True)
class Peer:
    """A method of a tool: its name in the table, what to import, what to install, and how it is called."""

    name: str
    module: str
    requirement: str
    poles: Poles

    @property
    def is_installed(self) -> bool:
        """Tell whether it can be run here."""
        return importlib.util.find_spec(self.module) is not None

    def __call__(self, case: Case) -> Answer:
        """Identify one bus; what it prints by the way is dropped."""
        with contextlib.redirect_stdout(io.StringIO()):
            try:
                return of_poles(self.poles(case.u.copy(), case.y.copy()))
            except (ArithmeticError, IndexError, ValueError, np.linalg.LinAlgError) as error:
                return Answer(refusal=f"{type(error).__name__}: {error}")


def sippy(method: str) -> Poles:
    """Return a subspace method of SIPPY."""

    def poles(u: Array, y: Array) -> Array:
        identify = importlib.import_module("sippy_unipi").system_identification
        return np.linalg.eigvals(identify(y, u, method, tsample=PERIOD_S, SS_fixed_order=ORDER).A)

    return poles


def nfoursid(u: Array, y: Array) -> Array:
    """Return the poles of nfoursid's model."""
    table = importlib.import_module("pandas").DataFrame({"torque": u, "speed": y})
    tool = importlib.import_module("nfoursid.nfoursid")
    method = tool.NFourSID(table, output_columns=["speed"], input_columns=["torque"], num_block_rows=HORIZON)
    method.subspace_identification()
    return np.linalg.eigvals(method.system_identification(rank=ORDER)[0].a)


def eigensystem(u: Array, y: Array) -> Array:
    """Return the poles of python-control's realisation."""
    control = importlib.import_module("control")
    impulse = np.ravel(control.markov(y, u, MARKOV, dt=PERIOD_S))
    rows = MARKOV // 2 - 1
    return np.linalg.eigvals(control.eigensys_realization(impulse, ORDER, m=rows, n=rows, dt=PERIOD_S)[0].A)


SIPPY, NFOURSID, CONTROL, SCIPY = "sippy_unipi==1.0.1", "nfoursid==1.0.2", "control==0.10.2", "scipy"

REFERENCE = "SIPPY: N4SID"
"""Processor times are reported as ratios to this one's."""

PEERS = (
    Peer(REFERENCE, "sippy_unipi", SIPPY, sippy("N4SID")),
    Peer("SIPPY: PARSIM-K", "sippy_unipi", SIPPY, sippy("PARSIM-K")),
    Peer("nfoursid: N4SID", "nfoursid", NFOURSID, nfoursid),
    Peer("python-control: ERA", "control", CONTROL, eigensystem),
    Peer("scipy: Box-Jenkins, AR(50)", "scipy", SCIPY, box_jenkins),
)
