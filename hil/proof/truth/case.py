"""A case: a specimen, three recordings of it to diagnose, and three fresh ones to judge by."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from hil.proof.truth.bus import NOMINAL_ERROR, PERIOD_S, Plan, Test, draw_plan, sample_times_s
from hil.proof.truth.driveline import TruthDriveline, bring_to_speed, observed
from hil.proof.truth.hidden import Interval
from hil.proof.truth.physics import FloatArray, Physics, StateIndex
from hil.proof.truth.recording import (
    USUAL,
    Acquisition,
    IntArray,
    Noise,
    Rows,
    as_recorded,
    sampling_instants_s,
    speed_as_read,
    speed_reading,
    torque_reading,
)
from hil.proof.truth.specimen import Specimen, Stream, draw_specimen, stream

TESTS = tuple(Test)

PROFILE_STRIDE = 25  # the truth keeps the load's disturbance every 0.25 s


@dataclass(frozen=True, slots=True)
class TruthRecording:
    """One recording. Arrays of shape (N,); the first five and ``flags``, where there are any, are the contract's.

    ``speed_load_rad_s`` is what a sensor at the wheels reads; a case's files have it only where that is asked for.

    ``speed_true_rad_s`` (the sensor's speed without noise), ``disturbance_nm`` (the torque of hill and brake against
    the load every 0.25 s) and ``events`` (when what took place) are the truth and go into no recording file.
    """

    time_s: FloatArray  # as the file has it: nominal, or the true instants
    torque_ref_nm: FloatArray  # of both inverters together, without reading noise
    torque_m1_nm: FloatArray  # of inverter m1, as read
    torque_m2_nm: FloatArray  # of inverter m2, as read
    speed_rad_s: FloatArray  # of the motor, as read
    speed_true_rad_s: FloatArray
    disturbance_nm: FloatArray
    flags: IntArray | None = None
    speed_load_rad_s: FloatArray | None = None
    events: Mapping[str, Sequence[Interval]] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Case:
    """What the tool gets, and what judges it; ``recordings`` and ``fresh`` in the order of `TESTS`."""

    specimen: Specimen  # that all recordings are of
    recordings: tuple[TruthRecording, ...]
    fresh: tuple[TruthRecording, ...]

    def truth(self) -> dict[str, object]:
        """Return what is sealed: JSON types only."""
        return {
            **self.specimen.truth(),
            "events": self._events(),
            "disturbance_period_s": PROFILE_STRIDE * PERIOD_S,
            "disturbance_nm": _disturbances(self.recordings),
            "disturbance_fresh_nm": _disturbances(self.fresh),
        }

    def named_recordings(self) -> dict[str, TruthRecording]:
        """Return all recordings by the names of their files: ``run_1`` and on, ``fresh_1`` and on."""
        names = [f"{kind}_{number}" for kind in ("run", "fresh") for number in range(1, len(TESTS) + 1)]
        return dict(zip(names, (*self.recordings, *self.fresh), strict=True))

    def _events(self) -> dict[str, dict[str, list[list[float]]]]:
        """When each event takes place, by effect and recording."""
        return {
            effect.name: {
                name: [list(interval) for interval in recording.events[effect.name]]
                for name, recording in self.named_recordings().items()
            }
            for effect in self.specimen.effects
            if effect.when is not None
        }


def _disturbances(recordings: tuple[TruthRecording, ...]) -> list[list[float]]:
    return [recording.disturbance_nm.round(3).tolist() for recording in recordings]


def make_case(effect: str, seed: int, nominal_error: float = NOMINAL_ERROR) -> Case:
    """Draw a bus, hide an effect in it, record it; see `draw_specimen`."""
    specimen = draw_specimen(effect, seed, nominal_error)
    recordings = tuple(record(specimen, number) for number in range(2 * len(TESTS)))
    return Case(specimen, recordings[: len(TESTS)], recordings[len(TESTS) :])


def record(specimen: Specimen, number: int, noise: Noise = USUAL) -> TruthRecording:
    """Draw and drive the specimen's recording of a number from 0; the kinds of `TESTS` take turns.

    With other noise the same is driven, and the same goes wrong in the same samples.
    """
    rng = stream(specimen.seed, Stream.RECORDING, number)
    test = number % len(TESTS)
    plan = draw_plan(TESTS[test], rng)
    rng_sensors, rng_effect, rng_acquisition = rng.spawn(3)
    physics = specimen.physics(rng_effect, test)
    recording = _drive(physics, plan, specimen.acquisition(test), noise, rng_sensors, rng_acquisition)
    return replace(recording, events=specimen.events(physics, test))


def _drive(
    physics: Physics,
    plan: Plan,
    acquisition: Acquisition,
    noise: Noise,
    rng_sensors: np.random.Generator,
    rng_acquisition: np.random.Generator,
) -> TruthRecording:
    rolling = bring_to_speed(physics, plan.speed_rad_s, plan.share_m1)
    torque = rolling.torque_nm + plan.torque_nm
    m1, m2 = plan.share_m1 * torque, (1.0 - plan.share_m1) * torque
    time_s = sample_times_s()
    instants_s = sampling_instants_s(time_s, acquisition, rng_acquisition)
    speed, disturbance, wheels = _sample(rolling.driveline, m1, m2, instants_s)
    m1_read, m2_read = (torque_reading(each, rng_sensors, noise) for each in (m1, m2))
    read = Rows(m1_read, m2_read, speed_as_read(speed, acquisition, rng_sensors, noise))
    rows = as_recorded(read, acquisition, rng_acquisition)
    return TruthRecording(
        time_s=instants_s if acquisition.stamps_told else time_s,
        torque_ref_nm=torque,
        torque_m1_nm=rows.torque_m1_nm,
        torque_m2_nm=rows.torque_m2_nm,
        speed_rad_s=rows.speed_rad_s,
        speed_true_rad_s=speed,
        disturbance_nm=disturbance[::PROFILE_STRIDE],
        flags=rows.flags,
        speed_load_rad_s=speed_reading(wheels, rng_sensors.spawn(1)[0], noise),
    )


def _sample(
    bus: TruthDriveline, m1_nm: FloatArray, m2_nm: FloatArray, instants_s: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Drive with torques that change every period; return speed, load disturbance and speed of the load at instants.

    The last torque stays on: a clock may ask for a speed after the last period.
    """
    switches_s = PERIOD_S * np.arange(1, m1_nm.size)
    moments_s = np.unique(np.concatenate([switches_s, instants_s, [0.0]]))
    held = np.searchsorted(switches_s, moments_s[:-1], side="right")
    states = np.vstack([bus.state, bus.course(m1_nm[held], m2_nm[held], np.diff(moments_s))])
    seen = states[np.searchsorted(moments_s, instants_s)]
    return *observed(bus.physics, seen), seen[:, StateIndex.SPEED_L]
