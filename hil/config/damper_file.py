"""The damper file, ``hil.damper/1``: a feedback as ``hil design damper`` writes it, and ``hil run`` drives it.

What is driven is judged again when it is read, by the line that the file itself names: poles, sensitivity, and that a
constant speed makes no torque. Whether it is for the rig at hand, `hil.rig.plan` looks.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Literal, Self

import numpy as np
import tomlkit
from pydantic import Field, model_validator

from estimator.damper import MOST_SENSITIVE, PARAMETERS, Filter, Loop, Timing, open_mode
from estimator.identification.modes.modes import Mode, two_mass_resonance
from hil.config.rig_file import Rig
from hil.config.table import FileTable, NotNegative, Positive, Text
from hil.errors import FileProblem
from hil.problems import Fault, read_toml, refuse, validate

SCHEMA = "hil.damper/1"

Two = Annotated[list[NotNegative], Field(min_length=2, max_length=2)]
Three = Annotated[list[float], Field(min_length=3, max_length=3)]


class FilterTable(FileTable):
    """Torque = -b(z) / a(z) speed, limited; the first of a is 1."""

    b: Three  # of the numerator, powers of 1/z from 0 [Nm s/rad]; their sum is 0
    a: Three  # of the denominator, powers of 1/z from 0


class DesignedFor(FileTable):
    """The rig, its limits, and the torque of both inverters together that the damper never exceeds there."""

    name: Text  # of the rig
    torque_limit_m1_nm: Positive  # of [inverters.m1]
    torque_limit_m2_nm: Positive  # of [inverters.m2]
    prbs_limit_nm: Positive  # of [guard]
    limit_nm: Positive  # of the damper, both inverters together

    @classmethod
    def of(cls, rig: Rig, limit_nm: float) -> Self:
        """Describe a rig."""
        m1_nm, m2_nm = rig.inverters.m1.torque_limit_nm, rig.inverters.m2.torque_limit_nm
        values = (rig.name, m1_nm, m2_nm, rig.guard.prbs_limit_nm, limit_nm)
        return cls.model_validate(dict(zip(cls.model_fields, values, strict=True)))


class DamperFile(FileTable):
    """The file; ``least_damping``, ``sensitivity`` and ``region_hz`` are of all lines, ``torque_nm`` under the PRBS."""

    schema_id: Annotated[Literal["hil.damper/1"], Field(alias="schema")]
    model: Text  # name of the model file it was designed by
    period_s: Annotated[float, Field(ge=0.001, le=1)]  # of the rig
    dead_time_s: Annotated[float, Field(ge=0, le=0.5)]  # from the speed sampled to the torque acting
    lag_s: NotNegative  # time constant of the torque
    region_hz: Annotated[list[Positive], Field(min_length=2, max_length=2)]
    least_damping: Positive
    sensitivity: Positive
    torque_nm: NotNegative
    line: dict[str, NotNegative]  # parameters of the nominal two-mass line, by name
    intervals: dict[str, Two] = Field(default_factory=dict)  # of the lines that it is good for
    filter: FilterTable  # the feedback itself
    rig: DesignedFor | None = None  # None: it was designed for none, and can't be driven

    @model_validator(mode="after")
    def _sound(self) -> Self:
        refuse(self._faults())
        return self

    def _faults(self) -> Iterator[Fault]:
        a, b, line = np.array(self.filter.a), np.array(self.filter.b), self.line
        if set(line) != set(PARAMETERS) or 0.0 in (line["J_M"], line["J_L"]) or two_mass_resonance(**line) is None:
            yield Fault("line", f"{', '.join(PARAMETERS)} of a line with a resonance", line)
        elif a[0] != 1.0 or np.max(np.abs(np.roots(a)), initial=0.0) >= 1.0:
            yield Fault("filter.a", "1 first, and a filter that is stable by itself", self.filter.a)
        elif abs(b.sum()) > 1e-9 * np.max(np.abs(b)):
            yield Fault("filter.b", "numbers that sum to 0, so that a constant speed makes no torque", self.filter.b)
        else:
            yield from self._faults_of_the_loop()

    def _faults_of_the_loop(self) -> Iterator[Fault]:
        before, after, peak = self.nominal
        if after.damping <= 0.0:
            yield Fault("filter", "a closed loop that is stable with the file's own line", "an unstable one")
        elif peak > MOST_SENSITIVE:
            yield Fault("filter", f"a sensitivity of at most {MOST_SENSITIVE:g} with the file's own line", peak)
        if not self.region_hz[0] <= before.frequency_hz <= self.region_hz[1]:
            yield Fault("region_hz", f"a range around the line's {before.frequency_hz:.2f} Hz", self.region_hz)

    @property
    def timing(self) -> Timing:
        """Period, dead time and lag."""
        return Timing(self.period_s, self.dead_time_s, self.lag_s)

    @property
    def nominal(self) -> tuple[Mode, Mode, float]:
        """The nominal line's resonance with the loop open and closed, and the sensitivity."""
        loop, K = Loop([self.line], self.timing), Filter(np.array(self.filter.b), np.array(self.filter.a))
        (hz,), (damping,) = loop.modes(K)
        return open_mode(self.line), Mode(float(hz), float(damping)), float(loop.sensitivity(K)[0])


def drivable(path: Path) -> tuple[DamperFile, DesignedFor]:
    """Read a damper file that is for a rig; refuse one without."""
    file = validate(DamperFile, read_toml(path, FileProblem), path, FileProblem)
    if file.rig is None:
        raise FileProblem(path, "rig | expected the rig it was designed for | got none: design it with --rig")
    return file, file.rig


def damper_toml(file: DamperFile) -> str:
    """Return its text; numbers with all their digits."""
    content = tomlkit.dumps(file.model_dump(by_alias=True, exclude_none=True))
    return f"# Active damping: torque = -b(z) / a(z) speed. Written by hil design damper; SI.\n{content}"
