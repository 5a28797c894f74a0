"""From what the command line asked for to what the view needs: a source, what is known of it, what can be started."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from drivers.errors import DriverError
from estimator.identification.chain import decimation_factor
from estimator.identification.online.regression import checked_filter
from estimator.physics.joint import Shaft
from hil.config.experiment_tables import PulsesTable, RestTable
from hil.config.model_file import read_model
from hil.config.rig_file import Rig
from hil.errors import HilError, RecordingError, UsageError
from hil.monitor.host import HostJob
from hil.monitor.live_estimation import WarmUp
from hil.monitor.messages import Choice
from hil.monitor.source import ReplaySource, RigSource, Source, recorded_samples
from hil.monitor.state import LiveState
from hil.result_folder import require_folder
from hil.rig.dry_run import dry_run
from hil.rig.live import USUAL, OnlineSetup
from hil.rig.replay import replay
from hil.rig.trace import is_trace
from hil.sample import Sample
from hil.simulator.driveline import simulation_model
from hil.simulator.rig_server import required_simulation


@dataclass(frozen=True, slots=True)
class Opening:
    """What the view is made of."""

    source: Source  # not entered yet: nothing is connected
    state: LiveState  # takes the source's reports
    choices: tuple[Choice, ...] = ()  # experiments of the rig file; empty where a recording is played


def open_rig(
    rig_path: Path,
    rig: Rig,
    out: Path,
    simulate: bool,
    model: Path | None,
    trust_laws: bool = False,
    setup: OnlineSetup = USUAL,
) -> Opening:
    """Prepare to watch a rig; nothing is connected before the source is entered."""
    if simulate:
        required_simulation(rig)
    require_folder(out)
    _require_chain(rig.period_s, setup)
    warm, shaft = WarmUp(rig.period_s, setup), _shaft(model, rig, trust_laws)
    state = LiveState(rig.name, rig.period_s, shaft, True, warm.is_done, setup, rig.channel_units)
    source = RigSource(HostJob(rig_path.absolute(), rig.of_monitor, out.absolute(), simulate, trust_laws, setup))
    return Opening(source, state, tuple(Choice(name, _summary(rig, name, trust_laws)) for name in rig.experiments))


def open_recording(
    path: Path,
    rig: Rig | None,
    speed: float,
    model: Path | None,
    trust_laws: bool = False,
    channel: str | None = None,
    setup: OnlineSetup = USUAL,
) -> Opening:
    """Prepare to play a recording, or a bus trace with the rig file it is of."""
    if is_trace(path):
        if rig is None:
            raise UsageError(f"{path}: expected its rig file as well: hil monitor RIG --replay {path.name}; got none")
        samples, units = list(replay(path, rig, whole=True, channel=channel)), rig.channel_units
    else:
        samples, units = recorded_samples(path)
    if len(samples) < 2:
        raise RecordingError(path, f"expected samples to play, got {len(samples)}. Record again.")
    period_s = float(np.median(np.diff([sample.time_s for sample in samples])))
    _require_chain(period_s, setup)
    warm, shaft = WarmUp(period_s, setup), _shaft(model, rig, trust_laws)
    state = LiveState(path.name, period_s, shaft, False, warm.is_done, setup, units)
    return Opening(ReplaySource(path.name, samples, speed, _has_prbs if is_trace(path) else None), state)


def _require_chain(period_s: float, setup: OnlineSetup) -> None:
    """Refuse a filter that was asked for and can't be used; without one, a run says why it has no estimate."""
    if setup.L is not None:
        decimation_factor(setup.settings, period_s)
        checked_filter("oefo", setup.L)


def _has_prbs(sample: Sample) -> bool:
    """Whether a sample of a bus trace is of the measured part: only there the PRBS runs."""
    return sample.prbs_nm != 0.0


def _shaft(model: Path | None, rig: Rig | None, trust_laws: bool) -> Shaft | None:
    """Numbers of the shaft: of the model file, else of the simulation; None where there are none."""
    if model is not None:
        shaft = Shaft.of_model(read_model(model, trust_laws).model, model.name)
        if shaft is None:
            raise UsageError(f"{model}: expected structure 'two_mass' and motion 'rotation' for the twist, got another")
        return shaft
    if rig is None or rig.simulation is None:
        return None
    return Shaft.of_model(simulation_model(rig.simulation, trust_laws), "[simulation]")


def _summary(rig: Rig, name: str, trust_laws: bool) -> str:
    """Tell what an experiment would command, and what to expect."""
    table = rig.experiments[name]
    after = ", from standstill on" if isinstance(table, PulsesTable | RestTable) else ", after the approach"
    kind = "PRBS" if table.multisine is None else "multi-sine"
    superposed = f"{kind} ±{rig.excitation_nm(table):g} Nm" if table.prbs else "no PRBS"
    lines = [
        f"{table.kind}: {table.duration_s:g} s are recorded{after}.",
        f"Base torque at most ±{table.torque_nm:g} Nm, {superposed}, both inverters together.",
    ]
    try:
        prediction = dry_run(rig, name, trust_laws)
    except (HilError, DriverError) as error:
        lines.append(f"Prediction: {error}")
    else:
        speed = prediction.speed_rad_s
        length_s = prediction.cycles * prediction.period_s
        lines.append(f"Predicted: {length_s:.0f} s in all, speed {speed.low:.1f} to {speed.high:.1f} rad/s.")
    return "\n".join(lines)
