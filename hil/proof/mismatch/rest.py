r"""The true mismatch: what a bus without its hidden effect leaves of a recording, re-tuned as far as a tool may.

Delta is the recording without noise less what the bus, with nothing hidden in it, does under the same torques as
recorded. Faults of the acquisition are in the recording, torques that were not recorded are held. What of Delta the six
parameters inside the nominal model's tolerances, each recording's load torque and its initial state can imitate is no
mismatch to anybody. To first order and inside the tolerances (I - P) Delta is left, with the projector P of
`hil.proof.power.nuisance`; but a tenth of an inertia moves a speed by so much that the second order is as large as many
an effect, so least squares are carried to their end here, from the true values.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import optimize

from hil.proof.mismatch.line import PARAMETERS, Line, line_of, scaled
from hil.proof.truth.bus import NOMINAL_TOLERANCE
from hil.proof.truth.case import TESTS, TruthRecording, record
from hil.proof.truth.physics import FloatArray
from hil.proof.truth.rows import BoolArray
from hil.proof.truth.sensors import SILENT
from hil.proof.truth.specimen import Specimen

STEP = 1e-5
"""Step of the finite differences, over the parameter's value: between rounding and curvature."""


@dataclass(frozen=True, slots=True)
class Heard:
    """A recording without noise.

    Attributes
    ----------
    torque_nm : ndarray, shape (N,)
        Of both inverters, as recorded; the last one is held where one is missing.
    speed_rad_s : ndarray, shape (N,)
        As recorded; 0 where it is missing.
    good : ndarray of bool, shape (N,)
        Rows in which nothing is missing or flagged.
    """

    torque_nm: FloatArray
    speed_rad_s: FloatArray
    good: BoolArray


def heard(recording: TruthRecording) -> Heard:
    """Return what a recording without noise says, and where."""
    torque_nm = recording.torque_m1_nm + recording.torque_m2_nm
    known = np.isfinite(torque_nm)
    good = known & np.isfinite(recording.speed_rad_s)
    if recording.flags is not None:
        good &= recording.flags == 0
    return Heard(
        torque_nm=torque_nm[np.maximum.accumulate(np.where(known, np.arange(known.size), 0))],
        speed_rad_s=np.where(good, recording.speed_rad_s, 0.0),
        good=good,
    )


def true_rest_rad_s(specimen: Specimen) -> list[FloatArray]:
    """Return what of each recording to diagnose the re-tuned bus without its hidden effect can't follow.

    Parameters
    ----------
    specimen
        The bus, what it hides, and its nominal model.

    Returns
    -------
    list of ndarray, shape (N,)
        Recording less line [rad/s]; 0 in rows in which something is missing.
    """
    recordings = [heard(record(specimen, test, SILENT)) for test in range(len(TESTS))]
    return retuned_rest_rad_s(specimen, recordings)


def retuned_rest_rad_s(specimen: Specimen, recordings: Sequence[Heard]) -> list[FloatArray]:
    """Return what the re-tuned bus leaves of recordings; see `true_rest_rad_s`."""

    def rest(shares: FloatArray) -> list[FloatArray]:
        line = line_of(scaled(specimen.bus, dict(zip(PARAMETERS, shares.tolist(), strict=True))))
        return [_rest(line, recording) for recording in recordings]

    def all_rests(shares: FloatArray) -> FloatArray:
        return np.concatenate(rest(shares))

    nominal = np.array([specimen.nominal[name] / getattr(specimen.bus, name) for name in PARAMETERS])
    found = optimize.least_squares(
        all_rests,
        np.ones(len(PARAMETERS)),
        bounds=(nominal * (1.0 - NOMINAL_TOLERANCE), nominal * (1.0 + NOMINAL_TOLERANCE)),
        diff_step=np.full(len(PARAMETERS), STEP),
        x_scale="jac",
    )
    return rest(found.x)


def _rest(line: Line, recording: Heard) -> FloatArray:
    """Return what a line leaves of a recording, its load torque and its initial state fitted: it is linear in them."""
    driven = line.speed_rad_s(recording.torque_nm, 0.0, np.zeros(3))
    columns = np.column_stack(line.of_load_and_start(driven.size)) * recording.good[:, np.newaxis]
    wanted = np.where(recording.good, recording.speed_rad_s - driven, 0.0)
    basis, _ = np.linalg.qr(columns)
    rest: FloatArray = wanted - basis @ (basis.T @ wanted)
    return rest
