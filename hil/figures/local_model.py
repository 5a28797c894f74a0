"""What a figure is drawn from: one experiment, what was identified from it, and the truth where it is known."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from estimator.identification.identify import Identification
from estimator.identification.linear_model import ComplexArray, LinearModel
from estimator.identification.modes.modes import Mode, two_mass_resonance
from estimator.identification.modes.reduced import third_order
from estimator.physics.model import DrivelineModel, Structure
from estimator.signals.record import FloatArray, Record

STATES, INPUTS = 3, 2

COHERENT = 0.9
"""Coherence from which on a spectral estimate is held against a model."""

HALF_TURN_DEG = 180.0

TRUTH, MODEL_FILE = "truth", "model file"
"""Names of what there is to compare with."""

NOT_KNOWN = float("nan")

AGREEMENT_DB = 3.0
"""On-line model and spectral estimate agree where they differ by no more: a factor of 1.4."""


@dataclass(frozen=True, slots=True)
class TwoMassLine:
    """A two-mass driveline without anything nonlinear, by the names of a model file [kg m^2, Nm/rad, Nm s/rad]."""

    J_M: float  # inertia of the motor
    J_L: float  # inertia of the load, at the motor shaft
    k: float  # stiffness of the shaft
    c: float  # damping of the shaft
    b_M: float  # noqa: N815 - viscous friction at the motor
    b_L: float  # noqa: N815 - viscous friction at the load

    @classmethod
    def of(cls, values: Mapping[str, float]) -> TwoMassLine:
        """Take the parameters of a two-mass model."""
        return cls(**{name: values[name] for name in Structure.TWO_MASS.parameter_names})

    @property
    def matrices(self) -> tuple[FloatArray, FloatArray]:
        """A, shape (3, 3), and B, shape (3, 2), of speeds and twist under the torques of motor and load."""
        a = np.array(
            [
                [-(self.c + self.b_M) / self.J_M, self.c / self.J_M, -self.k / self.J_M],
                [self.c / self.J_L, -(self.c + self.b_L) / self.J_L, self.k / self.J_L],
                [1.0, -1.0, 0.0],
            ]
        )
        return a, np.array([[1.0 / self.J_M, 0.0], [0.0, -1.0 / self.J_L], [0.0, 0.0]])

    def discrete(self, period_s: float) -> tuple[FloatArray, FloatArray]:
        """Return A and B for both torques held over a period [s]: the exponential of [[A, B], [0, 0]] T."""
        block = np.zeros((STATES + INPUTS, STATES + INPUTS))
        block[:STATES, :STATES], block[:STATES, STATES:] = self.matrices
        exponential = expm(block * period_s)
        return exponential[:STATES, :STATES], exponential[:STATES, STATES:]

    @property
    def resonance(self) -> Mode | None:
        """The oscillating pair of poles; None if it does not oscillate."""
        return two_mass_resonance(**asdict(self))

    def poles(self, sample_time_s: float) -> ComplexArray:
        """Return the three poles in z, exp(s T) of those in s."""
        a, _ = self.matrices
        return np.exp(np.linalg.eigvals(a).astype(np.complex128) * sample_time_s)

    def zeros(self, sample_time_s: float) -> ComplexArray:
        """Return exp(s T) of the two zeros from T to w_M: the load on its shaft, ``J_L s^2 + (c + b_L) s + k``.

        A sampled model has its zeros there only roughly, the better the slower they are.
        """
        s = np.roots([self.J_L, self.c + self.b_L, self.k])
        return np.exp(s.astype(np.complex128) * sample_time_s)

    def response(self, frequency_hz: FloatArray, held_s: float) -> ComplexArray:
        """Return the frequency response from T to w_M [rad/s per Nm] for a torque held over ``held_s``, shape (M,)."""
        a, b = self.discrete(held_s)
        z = np.exp(2j * np.pi * np.asarray(frequency_hz) * held_s)
        states = np.linalg.solve(z[:, np.newaxis, np.newaxis] * np.eye(STATES) - a, b[:, :1])
        return np.asarray(states[:, 0, 0], dtype=np.complex128)


@dataclass(frozen=True, slots=True)
class Reference:
    """A driveline to compare with: the simulation's own (``truth``), or what a model file expects (``model file``)."""

    name: str  # `TRUTH` or `MODEL_FILE`
    line: TwoMassLine  # without effects


@dataclass(frozen=True, slots=True)
class LocalModel:
    """One experiment, as the paper calls what comes of it."""

    record: Record  # as it was recorded, at 10 ms in the paper
    found: Identification  # on-line, off-line and spectral estimate of it
    reference: Reference | None = None  # what to draw next to them

    @classmethod
    def with_expected(cls, record: Record, found: Identification, expected: DrivelineModel | None) -> LocalModel:
        """Compare with what a model file expects; with nothing where that is no two-mass drive."""
        if expected is None or expected.structure is not Structure.TWO_MASS:
            return cls(record, found)
        return cls(record, found, Reference(MODEL_FILE, TwoMassLine.of(expected.values())))

    @property
    def name(self) -> str:
        """Name of the recording."""
        return self.record.name

    @property
    def online(self) -> LinearModel:
        """The model that OEFO arrived at."""
        return self.found.online

    @property
    def reference_mode(self) -> Mode | None:
        """Resonance of the reference; None without one, and where it does not oscillate."""
        return None if self.reference is None else self.reference.line.resonance

    def reference_response(self, frequency_hz: FloatArray) -> ComplexArray | None:
        """Return the reference's response to a torque held as the recording's is, shape (M,)."""
        if self.reference is None:
            return None
        return self.reference.line.response(frequency_hz, self.record.sample_time_s)

    @property
    def third_order(self) -> LinearModel | None:
        """The on-line model's third-order equivalent; None where it is unstable and has none."""
        return third_order(self.online).model if self.online.is_stable else None

    @property
    def coherent_hz(self) -> FloatArray:
        """Frequencies of the spectral estimate around the resonance with a coherence above 0.9, shape (K,).

        All of one stretch; none where there is no resonance, no spectral estimate, or no coherence.
        """
        spectral, mode = self.found.spectral, self.found.batch_resonance
        if spectral is None or mode is None:
            return np.empty(0)
        f = spectral.frequency_hz
        at = int(np.argmin(np.abs(f - mode.frequency_hz)))
        inside = unbroken(spectral.coherence > COHERENT, at)
        return f[inside]


def unbroken(is_in: NDArray[np.bool_], at: int) -> NDArray[np.bool_]:
    """Keep the unbroken stretch of True that holds an index, shape as given; all False where it is not True there."""
    kept = np.zeros_like(is_in)
    if is_in[at]:
        outside = np.flatnonzero(~is_in)
        low = outside[outside < at].max(initial=-1) + 1
        high = outside[outside > at].min(initial=is_in.size)
        kept[low:high] = True
    return kept


def decibels(response: ComplexArray) -> FloatArray:
    """Return 20 log10 of a magnitude [dB]."""
    with np.errstate(divide="ignore"):
        return np.asarray(20.0 * np.log10(np.abs(response)), dtype=np.float64)


def degrees(response: ComplexArray) -> FloatArray:
    """Return the phase from -180 to 180 [degree]; NaN where a line would jump from one end to the other."""
    angle = np.rad2deg(np.angle(response))
    jumps = np.abs(np.diff(angle, append=angle[-1:])) > HALF_TURN_DEG
    return np.asarray(np.where(jumps, np.nan, angle), dtype=np.float64)


@dataclass(frozen=True, slots=True)
class ExperimentRow:
    """One experiment; NaN where there is no such value."""

    name: str  # the recording
    online_hz: float  # natural frequency of the resonance [Hz]: of the on-line model
    offline_hz: float  # of the output-error model
    reference_hz: float  # of the reference
    online_damping: float  # damping ratio of the resonance: of the on-line model
    offline_damping: float  # of the output-error model
    reference_damping: float  # of the reference
    offline_db: float  # largest difference of the on-line model to the output-error model, over `coherent_hz`
    spectral_db: float  # largest difference of the on-line model to the spectral estimate, over `coherent_hz`
    # band around the resonance in which on-line model and spectral estimate agree; None where they do nowhere
    agrees_hz: tuple[float, float] | None
    reference_db: float  # largest difference of the on-line model to the reference, over `coherent_hz`
    fit_percent: float  # of the off-line model in free run
    status: str  # of the on-line estimate

    def error(self, what: str, how: str) -> float:
        """Return the relative error of ``what`` (hz, damping) as found ``how`` (online, offline) to the reference."""
        reference: float = getattr(self, f"reference_{what}")
        return getattr(self, f"{how}_{what}") / reference - 1.0 if reference else NOT_KNOWN


def row_of(model: LocalModel) -> ExperimentRow:
    """Return the figures of one experiment."""
    found = model.found
    online_hz, online_damping = _of(found.online_resonance)
    offline_hz, offline_damping = _of(found.batch_resonance)
    reference_hz, reference_damping = _of(model.reference_mode)
    offline_db, spectral_db, reference_db = _differences_db(model)
    return ExperimentRow(
        name=model.name,
        online_hz=online_hz,
        offline_hz=offline_hz,
        reference_hz=reference_hz,
        online_damping=online_damping,
        offline_damping=offline_damping,
        reference_damping=reference_damping,
        offline_db=offline_db,
        spectral_db=spectral_db,
        agrees_hz=_agreement(model),
        reference_db=reference_db,
        fit_percent=found.batch.fit_percent,
        status=found.estimate.status.value,
    )


def _of(mode: Mode | None) -> tuple[float, float]:
    return (NOT_KNOWN, NOT_KNOWN) if mode is None else (mode.frequency_hz, mode.damping)


def _differences_db(model: LocalModel) -> tuple[float, float, float]:
    f = model.coherent_hz
    spectral = model.found.spectral
    if f.size == 0 or spectral is None:
        return (NOT_KNOWN,) * 3
    online = model.online.response(f)
    seen = spectral.response[np.isin(spectral.frequency_hz, f)]
    return (
        _largest_db(online, model.found.batch.model.response(f)),
        _largest_db(online, seen),
        _largest_db(online, model.reference_response(f)),
    )


def _agreement(model: LocalModel) -> tuple[float, float] | None:
    """Return the unbroken band around the resonance in which on-line model and spectral estimate agree [Hz]."""
    spectral, mode = model.found.spectral, model.found.online_resonance
    if spectral is None or mode is None:
        return None
    f = spectral.frequency_hz[spectral.frequency_hz <= 0.5 / model.online.sample_time_s]
    difference_db = np.abs(decibels(model.online.response(f)) - decibels(spectral.response[: f.size]))
    at = int(np.argmin(np.abs(f - mode.frequency_hz)))
    inside = f[unbroken(difference_db <= AGREEMENT_DB, at)]
    return (float(inside[0]), float(inside[-1])) if inside.size else None


def _largest_db(response: ComplexArray, other: ComplexArray | None) -> float:
    return NOT_KNOWN if other is None else float(np.abs(decibels(response) - decibels(other)).max())


def mode_text(mode: Mode | None) -> str:
    """Return a resonance in words, for a caption."""
    return "no resonance" if mode is None else f"{mode.frequency_hz:.2f} Hz, ζ {mode.damping:.4f}"
