"""One trial of a power study: a bus with an effect of a given size, recorded with noise of its own."""

from __future__ import annotations

import zlib

import numpy as np

from hil.proof.power.drive import drive
from hil.proof.power.sizes import imposed
from hil.proof.truth.case import TESTS, Case, TruthRecording
from hil.proof.truth.experiments import sample_times_s
from hil.proof.truth.sensors import speed_reading, torque_reading
from hil.proof.truth.specimen import Specimen, Stream, stream


def trial_case(specimen: Specimen, size: float, trial: int, samples: int) -> Case:
    """Return a specimen's three recordings to diagnose with its effect at a size; there are no fresh ones.

    Parameters
    ----------
    specimen
        Hides one effect with a single size; its acquisition is faultless.
    size
        Of the effect, in its unit.
    trial
        Numbers the trials of one bus and effect: each has noise of its own.
    samples
        Length of each recording.
    """
    at_size = imposed(specimen, size)
    return Case(at_size, tuple(_recorded(at_size, test, trial, samples) for test in range(len(TESTS))), ())


def _recorded(specimen: Specimen, test: int, trial: int, samples: int) -> TruthRecording:
    driven = drive(specimen, test, samples)
    speed = driven.speed_rad_s()
    rng = stream(specimen.seed, Stream.RECORDING, test, 1 + trial, zlib.crc32(specimen.effect.encode()))
    m1, m2 = torque_reading(driven.m1_nm, rng), torque_reading(driven.m2_nm, rng)
    return TruthRecording(
        time_s=sample_times_s()[:samples],
        torque_ref_nm=driven.m1_nm + driven.m2_nm,
        torque_m1_nm=m1,
        torque_m2_nm=m2,
        speed_rad_s=speed_reading(speed, rng),
        speed_true_rad_s=speed,
        disturbance_nm=np.zeros(0),
    )
