"""``[signals]`` of a model file: which columns of a recording are time, torque and output, and in what unit.

A key left out means the contract's: ``time_s``, ``torque_m1_nm`` and ``torque_m2_nm``, ``speed_rad_s``.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from estimator.signals.record import Location, OutputKind
from hil.problems import Fault, refuse
from hil.recording import columns
from hil.recording.request import FormatHints, Request

Column = Annotated[str, Field(min_length=1)]


class _Strict(BaseModel):
    model_config = ConfigDict(strict=True, extra="forbid", frozen=True, allow_inf_nan=False)


class _Scaled(_Strict):
    """A column times ``scale`` is the SI quantity, reflected to the motor shaft."""

    column: Column
    scale: float = 1.0
    wraps_at: float | None = Field(default=None, gt=0)
    hold: bool = False

    @model_validator(mode="after")
    def _scale_is_not_zero(self) -> Self:
        refuse([Fault("scale", "a number other than 0", self.scale)] if self.scale == 0 else [])
        return self

    @property
    def given_scale(self) -> float | None:
        """The scale of the file; None where it gives none, and the unit decides."""
        return self.scale if "scale" in self.model_fields_set else None


class TimeSignal(_Strict):
    """The time of each row [s]: a column times ``scale``, or a fixed period ``sample_time_s``."""

    column: Column | None = None  # None with `sample_time_s`
    scale: float = Field(default=1.0, gt=0)
    sample_time_s: float | None = Field(default=None, gt=0)

    @property
    def given_scale(self) -> float | None:
        """The scale of the file; None where it gives none, and the unit decides."""
        return self.scale if "scale" in self.model_fields_set else None

    @model_validator(mode="after")
    def _is_one_of_two(self) -> Self:
        if (self.column is None) == (self.sample_time_s is None):
            got = "neither" if self.column is None else "both"
            refuse([Fault("", "either column or sample_time_s", got)])
        return self


class TorqueSignal(_Scaled):
    """One torque input [Nm; translation N]; the inputs are summed."""


class LoadSignal(_Scaled):
    """The measured torque of a load machine [Nm; translation N]; a positive one is against positive torque inputs."""


class OutputSignal(_Scaled):
    """The measured output [rad/s, rad, Nm; translation m/s, m, N] and where it is measured."""

    at: Annotated[Location, Field(strict=False)] = Location.MOTOR  # the motor, the load or the shaft


class MeasuredOutput(OutputSignal):
    """One of several measured outputs, of any kind the structure has there."""

    kind: Annotated[OutputKind, Field(strict=False)]  # speed, position, acceleration or torque

    @model_validator(mode="after")
    def _is_somewhere(self) -> Self:
        is_torque = self.kind is OutputKind.TORQUE
        if self.kind is OutputKind.FORCE or self.at is (Location.MOTOR if is_torque else Location.SHAFT):
            expected = "speed, position or acceleration at the motor or at the load, or torque at the shaft or the load"
            refuse([Fault("kind", expected, f"{self.kind.value} at the {self.at.value}")])
        return self


class MaskRange(_Strict):
    """Rows whose value in ``column``, as in the file, is outside ``min`` to ``max`` are missing samples."""

    column: Column
    min: float | None = None
    max: float | None = None

    @model_validator(mode="after")
    def _is_a_range(self) -> Self:
        if self.min is None and self.max is None:
            refuse([Fault("", "min, max or both", "neither")])
        elif self.min is not None and self.max is not None and self.min > self.max:
            refuse([Fault("max", f"{self.min} or more, the value of min", self.max)])
        return self


class SignalsConfig(_Strict):
    """How a recording is read.

    Attributes
    ----------
    torque
        The inputs; empty for the contract's two.
    speed, position, force
        The output: one of them; none for the contract's motor speed. For a joint on a bench ``position`` is the imposed
        motion, and the output is ``force`` or, without it, the sum of ``torque``.
    load
        A further input: the torque that a load machine puts on the load.
    outputs
        All measured outputs, or those beyond the one that ``speed`` or ``position`` names. The first speed or position
        among them is the recording's output; the others are further ones.
    mask
        Rows that count only inside these ranges.
    from_s, to_s
        The stretch that is read [s], in the recording's own time; all before and behind it is cut off.
    stretches
        Several such stretches, as pairs; rows between them are missing samples.
    format
        How a text file is written, where that can't be recognised.
    resample_s
        Period to which columns of different or uneven rates are brought [s]; nothing is without it.
    """

    time: TimeSignal = TimeSignal(column=columns.TIME)  # without it `time_s` [s]
    torque: list[TorqueSignal] = []
    speed: OutputSignal | None = None
    position: OutputSignal | None = None
    force: OutputSignal | None = None
    load: LoadSignal | None = None
    outputs: list[MeasuredOutput] = []
    mask: list[MaskRange] = []
    from_s: float | None = None
    to_s: float | None = None
    stretches: list[Annotated[list[float], Field(min_length=2, max_length=2)]] = []
    format: FormatHints = FormatHints()
    resample_s: float | None = Field(default=None, gt=0)

    @model_validator(mode="after")
    def _stretches_are_stretches(self) -> Self:
        if self.stretches and (self.from_s, self.to_s) != (None, None):
            refuse([Fault("stretches", "either from_s and to_s, or stretches", "both")])
        for number, (start_s, end_s) in enumerate(self.stretches_read()):
            if not start_s < end_s:
                where = f"stretches.{number}" if self.stretches else "to_s"
                refuse([Fault(where, f"an end after {start_s:g} s", end_s)])
        return self

    def stretches_read(self) -> list[tuple[float, float]]:
        """Return the stretches that are read [s]; none where all is."""
        if (self.from_s, self.to_s) == (None, None):
            return [(start_s, end_s) for start_s, end_s in self.stretches]
        start_s = -math.inf if self.from_s is None else self.from_s
        return [(start_s, math.inf if self.to_s is None else self.to_s)]

    @model_validator(mode="after")
    def _has_one_output(self) -> Self:
        given = [kind.value for kind, _ in self._outputs()]
        if len(given) > 1 and given != ["position", "force"]:
            expected = "one of speed, position, force (position and force together: an imposed motion)"
            refuse([Fault("", expected, " and ".join(given))])
        if self.load is not None and self.names_bench:
            refuse([Fault("load", "no such key next to an imposed motion, which needs no load", self.load.column)])
        taken = [*(each.column for each in self.torques()), self.output()[1].column]
        if self.load is not None and self.load.column in taken:
            refuse([Fault("load.column", "a column of its own", self.load.column)])
        refuse(self._outputs_taken())
        if self.outputs and not given and not self.is_own_recording and self._first_of_outputs is None:
            expected = "a speed or a position among them, or speed = { ... } for one"
            refuse([Fault("outputs", expected, ", ".join(output.kind.value for output in self.outputs))])
        return self

    def _outputs_taken(self) -> Iterator[Fault]:
        """Find outputs whose column is another one's, or an input; the one that ``speed`` names may be among them."""
        taken = {} if self._taken else dict.fromkeys((signal.column for signal in self.inputs()), "the inputs")
        for k, output in enumerate(self.outputs):
            if output.column in taken:
                expected = f"a column of its own, another than that of {taken[output.column]}"
                yield Fault(f"outputs.{k}.column", expected, output.column)
            taken.setdefault(output.column, f"outputs.{k}")

    @property
    def _first_of_outputs(self) -> MeasuredOutput | None:
        """The recording's output, where it is one of several that are named."""
        return next((each for each in self.outputs if each.kind in (OutputKind.SPEED, OutputKind.POSITION)), None)

    def _outputs(self) -> list[tuple[OutputKind, OutputSignal]]:
        pairs = (
            (OutputKind.SPEED, self.speed),
            (OutputKind.POSITION, self.position),
            (OutputKind.FORCE, self.force),
        )
        named: list[tuple[OutputKind, OutputSignal]] = [(kind, each) for kind, each in pairs if each is not None]
        first = self._first_of_outputs
        if named or first is None:
            return named
        if self.is_own_recording and not any(output.at is Location.MOTOR for output in self.outputs):
            return []  # the contract's motor speed; what is named are further outputs
        return [(first.kind, first)]

    @property
    def is_own_recording(self) -> bool:
        """True where the torques are the contract's columns: then the contract's ``flags`` count too."""
        return not self.torque

    @property
    def names_output(self) -> bool:
        """True where the output is not the contract's motor speed."""
        return bool(self._outputs())

    def further(self) -> list[MeasuredOutput]:
        """Return the outputs beyond the first one, and beyond what an imposed motion takes."""
        taken = {self.output()[1].column, *(signal.column for signal in self.inputs())}
        return [each for each in self.outputs if each.column not in taken]

    @property
    def names_bench(self) -> bool:
        """True where an imposed motion is named, and the torque or force that it takes."""
        return self.position is not None and (self._taken is not None or bool(self.torque))

    @property
    def _taken(self) -> OutputSignal | None:
        """What an imposed motion takes, where it is named as an output: a force, or the torque at a shaft."""
        is_alone = len(self.outputs) == 1 and self.outputs[0].kind is OutputKind.TORQUE and not self.torque
        return self.force or (self.outputs[0] if is_alone else None)

    def torques(self) -> list[TorqueSignal]:
        """Return the inputs, the contract's where none are named; on a bench, what is measured."""
        taken = self._taken
        if self.names_bench and taken is not None:
            return [TorqueSignal(**taken.model_dump(exclude={"at", "kind"}, exclude_unset=True))]
        own = [TorqueSignal(column=name) for name in (columns.TORQUE_M1, columns.TORQUE_M2)]
        return self.torque or own

    def inputs(self) -> list[TorqueSignal | LoadSignal]:
        """Return all that drives: the torques, and the load's where that is measured."""
        return [*self.torques(), *([] if self.load is None else [self.load])]

    def output(self) -> tuple[OutputKind, OutputSignal]:
        """Return kind and column of the output, the contract's motor speed where none is named."""
        return next(iter(self._outputs()), (OutputKind.SPEED, OutputSignal(column=columns.SPEED)))

    def columns(self) -> list[str]:
        """Return the names of all columns that are needed, but for the time."""
        named = [signal.column for signal in (*self.inputs(), self.output()[1], *self.further())]
        return list(dict.fromkeys([*named, *(mask.column for mask in self.mask)]))

    def held(self) -> list[str]:
        """Return the names of those whose last value counts until the next: as it is said, and what only masks."""
        signals = [*self.inputs(), self.output()[1], *self.further()]
        roles = {signal.column for signal in signals}
        return [*(signal.column for signal in signals if signal.hold), *(set(self.columns()) - roles)]

    def request(self, dbc: Path | None = None) -> Request:
        """Return what a reader has to know."""
        columns, held = tuple(self.columns()), tuple(self.held())
        return Request(self.format, columns, self.time.column, held, self.resample_s, dbc)
