"""One recording on the host and on the PLC: the chain of `estimator`, and the exported text as a program."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from estimator.identification.chain import OnlineChain, OnlineTrajectory
from estimator.identification.online.recursive import Trajectory
from estimator.identification.tracking.alarm import TrackingState
from estimator.signals.record import BoolArray, FloatArray
from hil.export.plc_estimator import PlcEstimator
from hil.export.structured_text import Precision, structured_text
from tests.export.iec.machine import Machine

STATUS = {"unestimated": 0, "estimated": 1, "invalid": 2, "not_excited": 3}
NOT_EXCITED = 5
"""The PLC's number of each status."""


@dataclass(frozen=True)
class Cycles:
    """What comes in, one value per cycle: torque of each inverter, speed, mask."""

    torque_m1_nm: FloatArray
    torque_m2_nm: FloatArray
    speed_rad_s: FloatArray
    okay: BoolArray


@dataclass(frozen=True)
class Kept:
    """What came out, one row per sample of the model."""

    theta: FloatArray
    errors: FloatArray  # predicted output, error before and after learning
    used: BoolArray
    reason: FloatArray
    status: FloatArray
    undetermined: BoolArray
    resonance: FloatArray = field(default_factory=lambda: np.zeros((0, 2)))  # [Hz], damping; 0 where there is none


def summed(cycles: Cycles) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Total torque, speed, mask."""
    return cycles.torque_m1_nm + cycles.torque_m2_nm, cycles.speed_rad_s, cycles.okay


def on_host(estimator: PlcEstimator, cycles: Cycles) -> OnlineTrajectory:
    """Run the on-line chain of `estimator`."""
    chain = OnlineChain(estimator.settings, estimator.cycle_s, estimator.L)
    return chain.run_block(estimator.cycle_s * np.arange(cycles.okay.shape[0]), *summed(cycles))


def exported(estimator: PlcEstimator, precision: Precision = Precision.DOUBLE) -> str:
    """Return the Structured Text of an estimator."""
    return structured_text(estimator, precision)


def on_plc(
    estimator: PlcEstimator, cycles: Cycles, folder: Path, precision: Precision = Precision.DOUBLE, reset_at: int = -1
) -> Kept:
    """Export and execute."""
    return execute(exported(estimator, precision), cycles, folder, reset_at)


def execute(text: str, cycles: Cycles, folder: Path, reset_at: int = -1) -> Kept:
    """Execute a text, one call per cycle."""
    machine = Machine(text, "FB_HilEstimator", folder)
    rows = []
    for k, (m1, m2, speed, okay) in enumerate(zip(*vars(cycles).values(), strict=True)):
        out = machine(reset=k == reset_at, torqueM1=m1, torqueM2=m2, speed=speed, okay=bool(okay))
        if out.isNew:
            rows.append([*_row(out), [out.frequency, out.damping]])
    return Kept(*(np.array(column) for column in zip(*rows, strict=True)))


def execute_oefo(text: str, u: FloatArray, y: FloatArray, okay: BoolArray, folder: Path) -> Kept:
    """Execute the estimator's own block alone, one call per sample."""
    machine = Machine(text, "FB_HilOefo", folder)
    rows = [
        _row(machine(torque=torque, speed=speed, okay=bool(good)))
        for torque, speed, good in zip(u, y, okay, strict=True)
    ]
    return Kept(*(np.array(column) for column in zip(*rows, strict=True)))


def _row(out: Any) -> tuple[object, ...]:
    errors = [out.yHat, out.ePrior, out.ePost]
    weak = [bool(flag) for flag in out.undetermined]
    return [*out.theta], errors, bool(out.used), out.reason, out.status, weak


def assert_equal_bits(plc: Kept, host: Trajectory | OnlineTrajectory) -> None:
    """Every number of the PLC is the host's, to the bit."""
    estimates = host.estimates if isinstance(host, OnlineTrajectory) else host
    status, reason = [STATUS[host[k].status.value] for k in range(len(host))], np.array(estimates.reason, dtype=int)
    if isinstance(host, OnlineTrajectory):
        reason[host.state == TrackingState.NOT_EXCITED] = NOT_EXCITED
        found = np.nan_to_num(np.column_stack([host.frequency_hz, host.damping]))
        assert np.array_equal(plc.resonance, found)
    assert plc.theta.shape == estimates.theta.shape
    assert np.array_equal(plc.theta, estimates.theta)
    assert np.array_equal(plc.errors, np.column_stack([estimates.y_hat, estimates.e_prior, estimates.e_post]))
    assert np.array_equal(plc.used, estimates.used)
    assert np.array_equal(plc.reason, reason)
    assert plc.status.tolist() == status
