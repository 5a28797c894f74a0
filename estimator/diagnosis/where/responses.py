"""The response from torque to output over frequency: as measured, and as models have it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy import stats

from estimator.diagnosis.result import Response
from estimator.diagnosis.where.locate import SEGMENT
from estimator.errors import NotExciting
from estimator.identification.spectral import SpectralEstimate, spectral_estimate
from estimator.physics.fit import FitResult
from estimator.physics.model import Structure
from estimator.signals.decimate import block_of
from estimator.signals.record import FloatArray, Record

COHERENT = 0.5
"""Share of the output's power that the torque must explain before a response is compared there."""

FEWEST_BLOCKS = 8
"""Blocks of samples that a segment holds at least (``spectral_estimate``)."""


def responses(before: FitResult, after: FitResult) -> dict[str, Response]:
    """Return the response of each recording and of both models in it; recordings too short or masked have none.

    Torque and output are differenced first: that changes no response, and a slow course of the speed does not leak. The
    models' responses are estimated from their simulations in the same way, so that what the method distorts is alike.
    A joint has none: its torque is the output.
    """
    found: dict[str, Response] = {}
    if before.problem.grid.structure is Structure.JOINT:
        return found
    for record, first, second in zip(before.problem.records, before.outputs, after.outputs, strict=True):
        segment = max(SEGMENT, FEWEST_BLOCKS * block_of(record.sample_time_s))
        try:
            measured = spectral_estimate(_differenced(record, record.output), segment)
        except NotExciting:  # not this recording: it is too short, or masked throughout
            continue
        simulated = [spectral_estimate(_differenced(record, output), segment) for output in (first, second)]
        found[record.name] = _response(measured, *simulated)
    return found


def _differenced(record: Record, output: FloatArray) -> Record:
    return replace(
        record,
        time_s=record.time_s[1:],
        torque_nm=np.diff(record.torque_nm, axis=0),
        output=np.diff(np.where(record.okay, output, 0.0)),
        okay=record.okay[1:] & record.okay[:-1],
        torque_okay=None,
        offset_s=None,
        reference_nm=None,
        load_nm=None,
    )


def _response(measured: SpectralEstimate, before: SpectralEstimate, after: SpectralEstimate) -> Response:
    return Response(
        measured.frequency_hz,
        measured.response,
        measured.magnitude_std,
        measured.coherence,
        before.response,
        after.response,
        _p_value(measured, before),
        _p_value(measured, after),
    )


def _p_value(measured: SpectralEstimate, model: SpectralEstimate) -> float:
    """Return how probable so large a difference of two responses is by chance, where the estimate is coherent."""
    good = (measured.coherence > COHERENT) & (measured.coherence < 1.0)
    if not good.any():
        return 1.0
    apart = np.abs(measured.response - model.response)[good] / measured.magnitude_std[good]
    degrees = 2.0 * float(good.sum())
    return float(stats.chi2.sf(float(apart @ apart), degrees))
