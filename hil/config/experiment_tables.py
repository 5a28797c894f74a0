"""The tables ``[experiments.NAME]``: one class per kind, distinguished by ``kind``.

Torques are of both inverters together. What every kind has:

- ``duration_s``: length of the recorded part; getting to the start speed and ramping out come on top;
- ``torque_nm``: the base torque never exceeds this magnitude, in any phase;
- ``slew_nm_per_s``: nor does it change faster than this;
- ``approach_timeout_s``: time in which the start speed must be reached;
- ``share_m1``: the part of the base torque that inverter m1 gives. A gain that is not what an inverter reports shows
  where the two share differently from test to test;
- ``prbs``: whether the PRBS is superposed on the recorded part.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from hil.config.table import NotNegative, Positive, Table
from hil.problems import Fault, refuse

APPROACH_TIMEOUT_S = 60.0
"""Time to reach the start speed where the file gives none [s]; it limits patience, not torque."""

EVEN_SHARE = 0.5
"""Both inverters give half: they drive one shaft, and equal currents heat them equally."""


class ExperimentTable(Table):
    """What every kind of experiment has; see the module's text."""

    duration_s: Positive
    torque_nm: Positive
    slew_nm_per_s: Positive
    approach_timeout_s: Positive = APPROACH_TIMEOUT_S
    share_m1: Annotated[float, Field(ge=0, le=1)] = EVEN_SHARE
    prbs: bool = True


class CruiseTable(ExperimentTable):
    """Hold ``speed_rad_s`` slowly while the PRBS acts: the paper's own test."""

    kind: Literal["cruise"]
    speed_rad_s: float


class ReversalTable(ExperimentTable):
    """Swing by ``swing_nm`` either way, turning where the speed reaches ``turning_speed_rad_s``."""

    kind: Literal["reversal"]
    turning_speed_rad_s: Positive
    swing_nm: Positive

    @model_validator(mode="after")
    def _swing_within_torque(self) -> Self:
        refuse(_part_above_torque("swing_nm", self.swing_nm, self.torque_nm))
        return self


class TipTable(ExperimentTable):
    """Step the torque by ``step_nm`` up and down about what holds ``speed_rad_s``, ``step_s`` each."""

    kind: Literal["tip"]
    speed_rad_s: NotNegative
    step_nm: Positive
    step_s: Positive

    @model_validator(mode="after")
    def _step_within_torque(self) -> Self:
        refuse(_part_above_torque("step_nm", self.step_nm, self.torque_nm))
        return self


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

    @model_validator(mode="after")
    def _step_within_torque(self) -> Self:
        refuse(_part_above_torque("step_nm", self.step_nm, self.torque_nm))
        return self


class RestTable(ExperimentTable):
    """Zero torque at standstill, armed: what the readings show of themselves. No torque, no slew, no PRBS."""

    kind: Literal["rest"]
    torque_nm: Annotated[float, Field(ge=0, le=0)] = 0.0
    slew_nm_per_s: Annotated[float, Field(ge=0, le=0)] = 0.0
    prbs: Literal[False] = False


DrivenTable = CruiseTable | ReversalTable | TipTable
"""Kinds that a speed control leads up to."""

AnyExperiment = Annotated[DrivenTable | PulsesTable | RestTable, Field(discriminator="kind")]


def _part_above_torque(key: str, value_nm: float, torque_nm: float) -> Iterator[Fault]:
    if value_nm > torque_nm:
        yield Fault(key, f"at most torque_nm of the same table ({torque_nm:g})", value_nm)
