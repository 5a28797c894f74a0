"""The tables ``[experiments.NAME]``, one class per kind, distinguished by ``kind``; and ``[prbs]``.

The PRBS is the pseudo-random binary torque, and which inverter carries it.
Torques are of both inverters together. What every kind has:

- ``duration_s``: length of the recorded part; getting to the start speed and ramping out come on top;
- ``torque_nm``: the base torque never exceeds this magnitude, in any phase;
- ``slew_nm_per_s``: nor does it change faster than this;
- ``approach_timeout_s``: time in which the start speed must be reached;
- ``share_m1``: the part of the base torque that inverter m1 gives. A gain that is not what an inverter reports shows
  where the two share differently from test to test;
- ``prbs``: whether the PRBS is superposed on the recorded part;
- ``prbs_amplitude_nm``, ``prbs_clock_divider``: those of this experiment in place of ``[prbs]``'s;
- ``multisine``: a multi-sine in place of the PRBS.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from enum import Enum
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from drivers.plc.types import PrbsSource
from estimator.signals.multisine import Lines, excited_lines, multisine_nm
from estimator.signals.record import FloatArray, IntArray
from hil.config.table import FileTable, NotNegative, Positive
from hil.problems import Fault, refuse

APPROACH_TIMEOUT_S = 60.0
"""Time to reach the start speed where the file gives none [s]; it limits patience, not torque."""

EVEN_SHARE = 0.5
"""Both inverters give half: they drive one shaft, and equal currents heat them equally."""


class MultisineTable(FileTable):
    """A multi-sine of ``period_s``, with power from ``lowest_hz`` to ``highest_hz``, never above ``amplitude_nm``.

    ``lines`` are ``"full"``, ``"odd"``, or ``"odd_random"`` with one odd line in four left out, by which distortion is
    distinguished from noise. ``amplitude_nm`` is that of both inverters together; they share it as the PRBS.
    """

    amplitude_nm: Positive
    period_s: Positive
    lowest_hz: Positive
    highest_hz: Positive
    lines: Annotated[Lines, Field(strict=False)] = Lines.ODD_RANDOM
    seed: Annotated[int, Field(ge=0)] = 1  # of the phases, and of the lines that are left out

    def excited(self, sample_time_s: float) -> IntArray:
        """Return the lines with power, as multiples of the fundamental, at a sampling time [s]."""
        samples = round(self.period_s / sample_time_s)
        return excited_lines(samples, sample_time_s, self.lowest_hz, self.highest_hz, self.lines, self.seed)

    def levels_nm(self, sample_time_s: float) -> FloatArray:
        """Return one period [Nm] at a sampling time [s]."""
        return multisine_nm(round(self.period_s / sample_time_s), self.excited(sample_time_s), self.amplitude_nm)


class ExperimentTable(FileTable):
    """What every kind of experiment has; see the module's text."""

    duration_s: Positive  # of the recorded part
    torque_nm: Positive  # largest magnitude of the base torque
    slew_nm_per_s: Positive  # its fastest change
    approach_timeout_s: Positive = APPROACH_TIMEOUT_S  # in which the start speed must be reached
    share_m1: Annotated[float, Field(ge=0, le=1)] = EVEN_SHARE  # of the base torque
    prbs: bool = True  # whether a PRBS, or a multi-sine, is superposed
    prbs_amplitude_nm: Positive | None = None  # None: that of [prbs]
    prbs_clock_divider: Annotated[int, Field(ge=1, le=65535)] | None = None  # None: that of [prbs]
    multisine: MultisineTable | None = None  # None: a PRBS

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        refuse(self._faults())
        return self

    def _faults(self) -> Iterator[Fault]:
        for key in ("swing_nm", "step_nm"):
            if (part_nm := getattr(self, key, 0.0)) > self.torque_nm:
                yield Fault(key, f"at most torque_nm of the same table ({self.torque_nm:g})", part_nm)
        if self.multisine is not None and not self.prbs:
            yield Fault("multisine", "no such table while prbs is false", {})
        for key in ("prbs_amplitude_nm", "prbs_clock_divider"):
            if getattr(self, key) is not None and (self.multisine is not None or not self.prbs):
                yield Fault(key, "no such key without a PRBS", getattr(self, key))


class CruiseTable(ExperimentTable):
    """Hold ``speed_rad_s`` slowly while the PRBS acts: the paper's own test."""

    kind: Literal["cruise"]
    speed_rad_s: float


class ReversalTable(ExperimentTable):
    """Swing by ``swing_nm`` either way, turning where the speed reaches ``turning_speed_rad_s``."""

    kind: Literal["reversal"]
    turning_speed_rad_s: Positive
    swing_nm: Positive


class TipTable(ExperimentTable):
    """Step the torque by ``step_nm`` up and down about what holds ``speed_rad_s``, ``step_s`` each."""

    kind: Literal["tip"]
    speed_rad_s: NotNegative
    step_nm: Positive
    step_s: Positive


class PulsesTable(ExperimentTable):
    """Pulses of ``step_nm`` both ways from standstill, ``step_s`` the shortest, without a speed controller.

    Ends where the speed exceeds ``most_speed_rad_s``. ``torque_nm`` may be left out: it is ``step_nm`` then. No PRBS.
    """

    kind: Literal["pulses"]
    step_nm: Positive
    step_s: Positive
    most_speed_rad_s: Positive
    prbs: Literal[False] = False

    @model_validator(mode="before")
    @classmethod
    def _torque_is_the_step(cls, keys: Any) -> Any:
        known = isinstance(keys, Mapping) and "step_nm" in keys
        return {"torque_nm": keys["step_nm"], **keys} if known else keys


class CoastTable(ExperimentTable):
    """Let go of the torque at ``speed_rad_s``: what slows the vehicle is its own. No PRBS."""

    kind: Literal["coast"]
    speed_rad_s: float
    prbs: Literal[False] = False


class RampTable(ExperimentTable):
    """Raise and lower the torque evenly through zero, from standstill: ``ramp_s`` from zero to ``swing_nm``."""

    kind: Literal["ramp"]
    swing_nm: Positive
    ramp_s: Positive


class RestTable(ExperimentTable):
    """Zero torque at standstill, armed: what the readings show of themselves. No torque, no slew, no PRBS."""

    kind: Literal["rest"]
    torque_nm: Annotated[float, Field(ge=0, le=0)] = 0.0
    slew_nm_per_s: Annotated[float, Field(ge=0, le=0)] = 0.0
    prbs: Literal[False] = False


DrivenTable = CruiseTable | ReversalTable | TipTable | CoastTable | RampTable
"""Kinds that a speed control leads up to."""

AnyExperiment = Annotated[DrivenTable | PulsesTable | RestTable, Field(discriminator="kind")]


class PrbsTarget(Enum):
    """Which inverter carries the PRBS."""

    BOTH = "both"
    M1 = "m1"
    M2 = "m2"
    SHARED = "shared"


_PARTS_M1 = {PrbsTarget.BOTH: 0.5, PrbsTarget.M1: 1.0, PrbsTarget.M2: 0.0}


class PrbsTable(FileTable):
    """The pseudo-random binary torque; ``amplitude_nm`` is that of both inverters together."""

    amplitude_nm: Positive
    cells: Annotated[int, Field(ge=2, le=16)] = 10  # of the shift register
    clock_divider: Annotated[int, Field(ge=1, le=65535)]  # cycles each level is held
    seed: Annotated[int, Field(ge=1, le=65535)]  # first state of the register
    source: Annotated[PrbsSource, Field(strict=False)]  # who makes it
    target: Annotated[PrbsTarget, Field(strict=False)]  # which inverter carries it
    share_m1: Annotated[float, Field(ge=0, le=1)] | None = None  # of the PRBS; only with target "shared"

    @property
    def parts_nm(self) -> dict[str, float]:
        """What each inverter carries of it [Nm]."""
        return {"m1": self.part_m1 * self.amplitude_nm, "m2": (1.0 - self.part_m1) * self.amplitude_nm}

    @property
    def part_m1(self) -> float:
        """Part of the PRBS that inverter m1 carries, 0 to 1; m2 carries the rest."""
        return _PARTS_M1.get(self.target, self.share_m1 or 0.0)

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        refuse(self._faults())
        return self

    def _faults(self) -> Iterator[Fault]:
        shared = self.target is PrbsTarget.SHARED
        if shared and self.share_m1 is None:
            yield Fault("share_m1", "the part of inverter m1, 0 to 1, since target is 'shared'", None)
        if not shared and self.share_m1 is not None:
            yield Fault("share_m1", f"no such key while target is '{self.target.value}'", self.share_m1)
        if self.seed >= 2**self.cells:
            yield Fault("seed", f"at most {2**self.cells - 1}, what {self.cells} cells hold", self.seed)
        if self.source is PrbsSource.PLC and self.cells != 10:
            yield Fault("cells", "10, the PLC's own shift register, since source is 'plc'", self.cells)
