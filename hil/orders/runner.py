"""Drive one ordered run: predicted, kept within a band of speed, recorded, and noted in the step's record."""

from __future__ import annotations

import json
from collections.abc import Callable, Hashable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field, FiniteFloat

from drivers.errors import CommandRefused
from estimator.physics.driveline import Load
from estimator.physics.layout import flat
from estimator.physics.model import DrivelineModel, Parameter, Structure
from estimator.physics.simulate import Stepper
from estimator.signals.record import FloatArray
from hil.config.rig_file import Rig
from hil.errors import RunAborted, StoreError
from hil.orders.order import Order, RigSource
from hil.recording.checksum import RIG_CHECKSUM, RIG_TEXT, text_sha256
from hil.recording.writer import RecordingWriter
from hil.rig.build import open_devices
from hil.rig.drive import CycleProgress
from hil.rig.dry_run import Ranges, on_paper
from hil.rig.experiments.base import BaseTorque, Experiment, Phase
from hil.rig.experiments.staged import LowPass
from hil.rig.metadata import run_metadata
from hil.rig.pacing import Pacer, device_patience_s, disk_patience_s
from hil.rig.plan import Plan, plan_run
from hil.rig.realtime import RealTimeGrants
from hil.rig.session import run_plan
from hil.rig.stop import StopRequest, stop_on_signals
from hil.rig.timing import RunTiming
from hil.sample import Sample
from hil.store import register_run

Number = Annotated[FiniteFloat, Field(ge=-1e30, le=1e30)]
"""Far beyond any quantity here, and what pages draw and multiply."""

Both = Annotated[list[Number], Field(min_length=2, max_length=2)]

NO_DRAG = 1e-3
"""Viscous friction of a vehicle of which only the inertia is known, over that inertia [1/s]: next to none."""

FILTER_S = 0.2
"""Low-pass of the speed [s]: a resonance at 8 Hz is a tenth of itself behind it."""

MARGIN_SHARE = 0.25
"""How far a speed may leave its predicted range, in parts of the way from standstill to its fastest: grade and drag are
not in the prediction, and slow a vehicle that begins rolling as much as one that begins at rest."""

RUNS = "runs"
"""Folder of the recordings, and of the store of runs, inside that of the commissioning."""


@dataclass(slots=True)
class RunRecord:
    """One run: its recording next to the state file, and what was predicted and measured [Nm, rad/s].

    ``whole`` is False where the run was ended early; its recording then holds what there was.
    """

    name: str  # of the order
    recording: str | None  # relative to the folder of the commissioning; None where nothing was recorded
    whole: bool
    seconds: float  # length of the whole run, approach and release included
    predicted: dict[str, Both]  # lowest and highest, by the names of `Ranges`
    measured: dict[str, Both]  # the same; names without a value are left out
    flagged: int = 0  # recorded samples with a flag
    recorded: int = 0  # samples of the measured part
    prbs_nm: float = 0.0  # amplitude of PRBS or multi-sine, both inverters together; 0 without
    last_rad_s: float = 0.0  # speed in the last cycle


def now_utc() -> str:
    """Return the present time as text."""
    return datetime.now(UTC).isoformat(timespec="seconds")


@dataclass(slots=True, kw_only=True)
class Prediction(Ranges):
    """What to expect of a run."""

    seconds: float  # Length of the whole run
    last_rad_s: float  # Speed at the end
    each_nm: FloatArray  # Torque of each inverter in the recorded part, shape (N, 2)
    course_rad_s: FloatArray  # Speed in the recorded part, shape (N,)

    @property
    def torque_nm(self) -> FloatArray:
        """Total torque of the recorded part, shape (N,)."""
        total: FloatArray = self.each_nm.sum(axis=1)
        return total


def rigid_model(rig: Rig) -> DrivelineModel:
    """Return what the rig file alone says of the vehicle: its inertia."""
    inertia = rig.vehicle.inertia_kg_m2
    return DrivelineModel(
        Structure.ONE_MASS, {"J_M": Parameter(inertia, 0.5), "b_M": Parameter(NO_DRAG * inertia, 0.5)}
    )


def predict(rig: Rig, name: str, model: DrivelineModel, speed_rad_s: float = 0.0) -> Prediction:
    """Predict a run of one experiment of a rig file, from standstill or rolling at a speed [rad/s].

    The load torque is the model's where it says one, else none.
    """
    load_nm = 0.0 if isinstance(model.load, Load) else model.load
    vehicle = Stepper(model, rig.period_s, load_nm, speed_rad_s)
    ranges, cycles = Ranges(), 0
    torque: list[tuple[float, float]] = []
    course: list[float] = []
    for phase, request, now_rad_s in on_paper(rig, name, vehicle):
        each_nm = request.total_m1_nm, request.total_m2_nm
        ranges.see(phase, *each_nm, now_rad_s)
        cycles += 1
        if phase is Phase.MEASURE:
            torque.append(each_nm)
            course.append(now_rad_s)
    return Prediction(
        ranges.torque_m1_nm,
        ranges.torque_m2_nm,
        ranges.speed_rad_s,
        ranges.speed_measured_rad_s,
        seconds=cycles * rig.period_s,
        last_rad_s=vehicle.speed_rad_s,
        each_nm=np.array(torque).reshape(-1, 2),
        course_rad_s=np.array(course),
    )


class SpeedBandLeft(RunAborted):
    """The vehicle moved otherwise than was predicted of it: driven again, the same experiment would end alike."""


@dataclass(slots=True)
class WithinBand:
    """An experiment inside a speed band.

    Where the vehicle rolls at the beginning, the band reaches from there.
    """

    experiment: Experiment  # What is driven
    low_rad_s: float  # lower end of the band
    high_rad_s: float  # upper end of the band
    margin_rad_s: float  # What the speed at the beginning is given next to it
    period_s: float  # Time between two cycles [s]
    _speed: LowPass | None = None  # None before the first cycle

    @property
    def duration_s(self) -> float:
        """Length of the measured part [s]."""
        return self.experiment.duration_s

    def torque(self, time_s: float, speed_rad_s: float) -> BaseTorque:
        """Torque and phase of one cycle; see `hil.rig.experiments.base.Experiment`."""
        if self._speed is None:
            self._speed = LowPass(FILTER_S, self.period_s)
            self.low_rad_s = min(self.low_rad_s, speed_rad_s - self.margin_rad_s)
            self.high_rad_s = max(self.high_rad_s, speed_rad_s + self.margin_rad_s)
        smooth_rad_s = self._speed.update(speed_rad_s)
        if not self.low_rad_s <= smooth_rad_s <= self.high_rad_s:
            raise SpeedBandLeft(
                f"speed band: the speed is {smooth_rad_s:.1f} rad/s, expected {self.low_rad_s:.1f} to "
                f"{self.high_rad_s:.1f} rad/s, what was predicted and a margin. The run was ended at zero torque. Look "
                "for a grade, a wrong sign, or an inertia in the rig file that is far off."
            )
        return self.experiment.torque(time_s, speed_rad_s)


@dataclass(frozen=True, slots=True)
class Band:
    """What a run's speed is kept between [rad/s]."""

    low_rad_s: float  # lower end
    high_rad_s: float  # upper end
    margin_rad_s: float  # of this, how far beyond what was predicted

    @classmethod
    def around(cls, predictions: Sequence[Ranges], least_rad_s: float) -> Band:
        """Return the band that holds for each of these predictions, with a margin of at least so much."""
        low = min(each.speed_rad_s.low for each in predictions)
        high = max(each.speed_rad_s.high for each in predictions)
        margin = margin_rad_s(low, high, least_rad_s)
        return cls(low - margin, high + margin, margin)


def margin_rad_s(low_rad_s: float, high_rad_s: float, least_rad_s: float) -> float:
    """Return the margin of a predicted range [rad/s]."""
    return max(least_rad_s, MARGIN_SHARE * (max(high_rad_s, 0.0) - min(low_rad_s, 0.0)))


@dataclass(frozen=True, slots=True)
class Conditions:
    """What a run is driven under: pacing, real-time scheduling, progress."""

    pace: str  # Its name, for the recording
    pacer: Callable[[Rig], Pacer]  # Makes a fresh pacer
    # asks for real time for the time of a block, or for nothing
    scheduling: Callable[[], AbstractContextManager[RealTimeGrants]]
    progress: Callable[[Plan], AbstractContextManager[CycleProgress]]  # Shows a run for the time of a block


@dataclass(slots=True)
class _Measured(Ranges):
    """What was measured over a whole run."""

    last_rad_s: float = 0.0
    cycles: int = 0
    recorded: int = 0
    flagged: int = 0

    def take(self, sample: Sample, phase: Phase) -> None:
        self.see(phase, sample.torque_m1_nm, sample.torque_m2_nm, sample.speed_rad_s)
        self.cycles += 1
        self.last_rad_s = sample.speed_rad_s
        if phase is Phase.MEASURE:
            self.recorded += 1
            self.flagged += bool(sample.flags)


@dataclass(frozen=True, slots=True)
class Runner:
    """Runs orders of one commissioning."""

    source: RigSource  # The user's rig file
    folder: Path  # Of the commissioning
    conditions: Conditions  # How runs are driven
    # by text of the rig file, model and speed at the beginning
    _predicted: dict[tuple[Hashable, ...], Prediction] = field(default_factory=dict)

    def predict(self, order: Order, model: DrivelineModel, speed_rad_s: float) -> Prediction:
        """Predict an order for a vehicle that rolls at a speed [rad/s]; the same one is predicted once."""
        rig, text = self.source.ordered(order)
        start_rad_s = 0.0 if order.from_standstill else round(speed_rad_s, 2)
        key = (text, model.structure, flat(model).tobytes(), start_rad_s)
        if key not in self._predicted:
            self._predicted[key] = predict(rig, order.name, model, start_rad_s)
        return self._predicted[key]

    def predictions(self, order: Order, lines: Sequence[DrivelineModel], speed_rad_s: float) -> list[Prediction]:
        """Predict an order for each line that the vehicle may be; left out is one with which it would end early.

        Where it would with each of them, the error of the first is raised.
        """
        made: list[Prediction] = []
        refused: list[RunAborted | CommandRefused] = []
        for line in lines:
            try:
                made.append(self.predict(order, line, speed_rad_s))
            except (RunAborted, CommandRefused) as error:
                refused.append(error)
        if not made:
            raise refused[0]
        return made

    def run(
        self,
        step: str,
        order: Order,
        lines: Sequence[DrivelineModel],
        speed_rad_s: float,
        note: Callable[[RunRecord], None],
    ) -> RunRecord:
        """Drive an order, record it, and return its record; ``note`` is given that of a run that is ended early too.

        The band of speed holds for each line that the vehicle may be, the most probable first.
        """
        rig, text = self.source.ordered(order)
        predictions = self.predictions(order, lines, speed_rad_s)
        prediction, band = predictions[0], Band.around(predictions, order.least_margin_rad_s)
        path, seen = self._free_path(step, order), _Measured()

        def record(whole: bool) -> RunRecord:
            return RunRecord(
                name=order.name,
                recording=str(path.relative_to(self.folder)) if path.exists() else None,
                whole=whole,
                seconds=round(seen.cycles * rig.period_s, 3),
                predicted=prediction.as_json(),
                measured=seen.as_json(),
                flagged=seen.flagged,
                recorded=seen.recorded,
                prbs_nm=rig.excitation_nm(rig.experiments[order.name]),
                last_rad_s=seen.last_rad_s,
            )

        try:
            self._drive(rig, text, order, band, path, seen, step)
        except BaseException as error:
            note(record(False))
            _enter_ended(path, error)
            raise
        run = record(True)
        note(run)
        register_run(path)
        return run

    def _drive(self, rig: Rig, text: str, order: Order, band: Band, path: Path, seen: _Measured, step: str) -> None:
        pacer, stop = self.conditions.pacer(rig), StopRequest()
        timing = RunTiming(pacer.period_ns)
        plan = _banded(plan_run(rig, order.name), band)
        metadata = run_metadata(self.source.path, order.name) | {
            RIG_TEXT: text,
            RIG_CHECKSUM: text_sha256(text),
            "commissioning_step": step,
            "pace": self.conditions.pace,
        }
        path.parent.mkdir(parents=True, exist_ok=True)
        recorder = RecordingWriter(path, metadata, disk_patience_s(pacer), rig.channel_units)
        with (
            stop_on_signals(stop),
            recorder,
            self.conditions.scheduling() as grants,
            self.conditions.progress(plan) as progress,
            open_devices(rig, device_patience_s(pacer)) as devices,
        ):
            recorder.describe("real_time", json.dumps(grants.as_json()))
            try:
                run_plan(devices, plan, pacer, recorder, stop, progress, timing, (seen.take,))
            finally:
                recorder.describe("timing", json.dumps(timing.as_json()))

    def _free_path(self, step: str, order: Order) -> Path:
        """Return a recording's name that is not taken, also not by what a killed run left."""
        number = 1
        while True:
            stem = f"{step}-{order.name}" + (f"-{number}" if number > 1 else "")
            path = self.folder / RUNS / f"{stem}.parquet"
            if not path.exists() and not path.with_name(f"{stem}.part.csv").exists():
                return path
            number += 1


def _banded(plan: Plan, band: Band) -> Plan:
    limits = band.low_rad_s, band.high_rad_s, band.margin_rad_s
    return replace(plan, experiment=WithinBand(plan.experiment, *limits, plan.period_s))


def _enter_ended(path: Path, error: BaseException) -> None:
    """Enter what there is of a run that was ended early; what ended it is reported first."""
    if not path.exists():
        return
    try:
        register_run(path, str(error) or type(error).__name__)
    except StoreError as lost:
        error.add_note(str(lost))
