"""The table ``[prbs]`` of a rig file: the pseudo-random binary torque, and which inverter carries it."""

from __future__ import annotations

from collections.abc import Iterator
from enum import Enum
from typing import Annotated, Self

from pydantic import Field, model_validator

from drivers.plc.types import PrbsSource
from hil.config.table import Positive, Table
from hil.problems import Fault, refuse


class PrbsTarget(Enum):
    """Which inverter carries the PRBS."""

    BOTH = "both"
    M1 = "m1"
    M2 = "m2"
    SHARED = "shared"


_PARTS_M1 = {PrbsTarget.BOTH: 0.5, PrbsTarget.M1: 1.0, PrbsTarget.M2: 0.0}


class PrbsTable(Table):
    """The pseudo-random binary torque; ``amplitude_nm`` is that of both inverters together."""

    amplitude_nm: Positive
    cells: Annotated[int, Field(ge=2, le=16)] = 10
    clock_divider: Annotated[int, Field(ge=1, le=65535)]
    seed: Annotated[int, Field(ge=1, le=65535)]
    source: Annotated[PrbsSource, Field(strict=False)]
    target: Annotated[PrbsTarget, Field(strict=False)]
    share_m1: Annotated[float, Field(ge=0, le=1)] | None = None

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
