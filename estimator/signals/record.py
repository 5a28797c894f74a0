"""One recording as the estimator sees it: uniformly sampled SI arrays and a mask, nothing of files or buses."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from enum import Enum
from functools import wraps
from itertools import pairwise
from typing import Any, TypeVar
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from estimator.errors import BadShape

Object = TypeVar("Object")
Result = TypeVar("Result")

MOST_BYTES = 2**20
"""Size of an array that is kept, at most: what is asked for again and again is of stretches, not of whole hours."""

DIGITS = 9  # digits a period is rounded to at most, so that 0.01 s is 0.01 s in every recording of a rig
ALLOWED = 3.0  # the roundest period within so many standard errors is taken

MOST_JITTER = 0.005
"""... but not beyond this share of the period: a few wild stamps determine nothing."""


def once(function: Callable[[Object], Result]) -> Callable[[Object], Result]:
    """Remember what a function returns for each object, as long as that lives; arrays of more than ``MOST_BYTES`` not.

    Only for objects that are distinguished by what they are and not by what they hold, and never change. What is
    returned is shared: nobody may write to it.
    """
    known: WeakKeyDictionary[Object, Result] = WeakKeyDictionary()

    @wraps(function)
    def remembered(of: Object) -> Result:
        try:
            return known[of]
        except KeyError:
            result = function(of)
        if isinstance(result, np.ndarray) and result.nbytes > MOST_BYTES:
            return result
        return known.setdefault(of, result)

    return remembered


FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int64]


class OutputKind(Enum):
    """The measured output; its value is the quantity's name in files and messages."""

    SPEED = "speed"
    POSITION = "position"
    FORCE = "force"
    TORQUE = "torque"
    ACCELERATION = "acceleration"


class Location(Enum):
    """Where in the driveline the output is measured."""

    MOTOR = "motor"
    LOAD = "load"
    SHAFT = "shaft"


@dataclass(frozen=True, slots=True, eq=False)
class Channel:
    """A further measured output of a recording."""

    kind: OutputKind  # what it is, and where it is measured
    location: Location  # motor or load
    label: str  # the column it was read from
    output: FloatArray  # (N,): its readings [rad/s, rad, Nm, rad/s^2; translation m/s, m, N, m/s^2]
    okay: BoolArray  # (N,): false where a reading must not be used


@dataclass(frozen=True, slots=True, eq=False, weakref_slot=True)
class Record:
    """A recording on a uniform time base, reflected to the motor shaft; equal to itself alone.

    Attributes
    ----------
    name : str
        File stem; names the recording in every result.
    sample_time_s : float
        Sampling period [s].
    time_s : ndarray, shape (N,)
        Time of each sample [s]; ``time_s[k+1] - time_s[k]`` is the sampling period.
    torque_nm : ndarray, shape (N, M)
        Torque (translation: force, N) of each of the M inputs. Sample k acts from ``time_s[k]`` to
        ``time_s[k+1]`` (zero-order hold).
    output : ndarray, shape (N,)
        Measured output [rad/s, rad, Nm; translation m/s, m, N].
    okay : ndarray of bool, shape (N,)
        False where the sample must not be used; time advances there.
    kind, location
        What the output is, and where it is measured.
    began_s : float, optional
        When the recording began that this one is a part of [s]: laws over time count from there. None: at its start.
    torque_okay : ndarray of bool, shape (N, M) or (N,), optional
        False where a torque was not read, or not to be trusted, and ``torque_nm`` holds a stand-in. None: all read.
    reference_nm : ndarray, shape (N,), optional
        Torque that was asked for, of all inputs together [Nm]; NaN where not known. None: not recorded.
    load_nm : ndarray, shape (N,), optional
        Measured torque of a load machine, held over each period as ``torque_nm``; a positive one is against it [Nm;
        translation N]. It acts at the load, in addition to the constant load torque. None: not measured.
    imposed : ndarray, shape (N,), optional
        Motion that a bench imposes on a joint [rad; translation m]; the output is then the torque it takes, which
        ``torque_nm`` holds too. None: the torque acts and the motion is measured.
    offset_s : ndarray, shape (N,), optional
        True sampling instant of the output less ``time_s`` [s]. None: on time.
    channels : tuple of Channel
        Further measured outputs.
    lead : Record, optional
        The recording that this one is a further output of (``signals.outputs``); None: it is the recording itself.
    label : str
        Names the further output; empty for the first one.
    unit : float
        What ``output`` is given in, in SI units.
    inputs : tuple of str
        The columns that the torques were read from; empty where they have none.
    unused : tuple of Channel
        Columns that look like torques and are not used; empty in what is fitted.
    """

    name: str
    sample_time_s: float
    time_s: FloatArray
    torque_nm: FloatArray
    output: FloatArray
    okay: BoolArray
    kind: OutputKind = OutputKind.SPEED  # of the output
    location: Location = Location.MOTOR  # where it was measured
    began_s: float | None = None
    torque_okay: BoolArray | None = None
    offset_s: FloatArray | None = None
    imposed: FloatArray | None = None
    reference_nm: FloatArray | None = None
    load_nm: FloatArray | None = None
    channels: tuple[Channel, ...] = ()
    lead: Record | None = None
    label: str = ""
    unit: float = 1.0
    inputs: tuple[str, ...] = ()
    unused: tuple[Channel, ...] = ()

    def __post_init__(self) -> None:
        n = self.time_s.shape[0]
        shapes = {"torque_nm": self.torque_nm.shape[:1], "output": self.output.shape, "okay": self.okay.shape}
        optional = {
            "offset_s": self.offset_s,
            "imposed": self.imposed,
            "reference_nm": self.reference_nm,
            "load_nm": self.load_nm,
        }
        shapes |= {name: values.shape for name, values in optional.items() if values is not None}
        shapes |= {f"output {channel.label}": channel.output.shape for channel in self.channels}
        for name, shape in shapes.items():
            if shape != (n,):
                raise BadShape(
                    f"recording {self.name}: {name} has shape {shape}, expected ({n},) like time_s. "
                    "Give every signal one value per sample."
                )
        if self.torque_nm.ndim != 2 or self.torque_nm.shape[1] == 0:
            raise BadShape(
                f"recording {self.name}: torque_nm has shape {self.torque_nm.shape}, expected (N, M) with "
                "one column per torque input."
            )
        if not (np.isfinite(self.torque_nm).all() and np.isfinite(self.output[self.okay]).all()):
            raise BadShape(
                f"recording {self.name}: torque or unmasked output holds NaN or infinity. "
                "Mask such samples with okay = False and hold the last torque."
            )
        if self.load_nm is not None and not np.isfinite(self.load_nm).all():
            raise BadShape(
                f"recording {self.name}: load_nm holds NaN or infinity. "
                "Mask such samples with okay = False and hold the last torque."
            )
        if self.imposed is not None and not np.isfinite(self.imposed).all():
            raise BadShape(
                f"recording {self.name}: the imposed motion holds NaN or infinity. "
                "Mask such samples with okay = False and bridge the motion."
            )
        if self.torque_okay is not None and self.torque_okay.shape not in ((n,), self.torque_nm.shape):
            raise BadShape(
                f"recording {self.name}: torque_okay has shape {self.torque_okay.shape}, expected ({n},) or "
                f"{self.torque_nm.shape}. Give one value per sample, or one per sample and torque input."
            )
        if self.offset_s is not None and not np.isfinite(self.offset_s).all():
            raise BadShape(
                f"recording {self.name}: offset_s holds NaN or infinity. Give 0 where the instant is not known."
            )

    def input(self, number: int) -> str:
        """Name a torque input, from 0: by its column, where it has one."""
        column = f" ({self.inputs[number]})" if number < len(self.inputs) else ""
        return f"torque input {number + 1}{column}"

    @property
    def torque_trusted(self) -> BoolArray:
        """Where each torque was read and is to be trusted; shape (N, M)."""
        if self.torque_okay is None:
            return np.ones(self.torque_nm.shape, dtype=np.bool_)
        by_row = self.torque_okay if self.torque_okay.ndim == 2 else self.torque_okay[:, np.newaxis]
        return np.broadcast_to(by_row, self.torque_nm.shape)

    @property
    def read(self) -> BoolArray | None:
        """Whether every torque was read, shape (N,); None where all were."""
        return None if self.torque_okay is None else np.asarray(self.torque_trusted.all(axis=1), dtype=np.bool_)

    @property
    @once
    def since_start_s(self) -> FloatArray:
        """Time since the recording began, shape (N,) [s]."""
        began = self.time_s[0] if self.began_s is None else self.began_s
        return self.time_s - began

    @property
    def known_load_nm(self) -> FloatArray | float:
        """Measured torque of a load machine, shape (N,) [Nm]; 0 where none is measured."""
        return 0.0 if self.load_nm is None else self.load_nm

    @property
    @once
    def total_torque_nm(self) -> FloatArray:
        """Sum of the torque inputs, T_tot = T_M1 + T_M2 in the paper; shape (N,) [Nm]."""
        return self.torque_nm.sum(axis=1)


def sliced(record: Record, rows: slice, name: str | None = None) -> Record:
    """Return some rows of a recording, with all that belongs to them, under another name if one is given."""
    parts: dict[str, Any] = {
        field.name: values[rows]
        for field in fields(record)
        if isinstance(values := getattr(record, field.name), np.ndarray)  # each has a row per sample
    }
    channels, unused = (
        tuple(replace(each, output=each.output[rows], okay=each.okay[rows]) for each in several)
        for several in (record.channels, record.unused)
    )
    began_s = float(record.time_s[0]) if record.began_s is None else record.began_s
    name = record.name if name is None else name
    return replace(record, name=name, began_s=began_s, channels=channels, unused=unused, **parts)


def uniform_period_s(time_s: FloatArray) -> float:
    """Return the sampling period behind a recording's stamps [s]."""
    rows = np.arange(time_s.size) - 0.5 * (time_s.size - 1)
    since = time_s - time_s.mean()
    power = float(rows @ rows)
    slope = float(rows @ since) / power
    left = since - slope * rows
    error = float(np.sqrt(left @ left / max(time_s.size - 2, 1) / power))
    allowed = min(ALLOWED * error, MOST_JITTER * slope)
    for digits in range(1, DIGITS):
        rounded = float(f"{slope:.{digits}g}")
        if abs(rounded - slope) <= allowed:
            return rounded
    return float(f"{slope:.{DIGITS}g}")


Noise = Callable[[Sequence[Record]], float]


def separated_outputs(records: Sequence[Record], noise_of: Noise) -> list[Record]:
    """Return a recording for each measured output, the further ones weighed by their noise as the first is by its."""
    alone = [replace(record, channels=()) for record in records]
    first = noise_of(alone) if any(record.channels for record in records) else 1.0
    further: list[Record] = []
    for label in labels(records):
        parts = [
            _alone(record, channel, lead)
            for record, lead in zip(records, alone, strict=True)
            for channel in record.channels
            if channel.label == label
        ]
        unit = noise_of(parts) / first
        further += [replace(part, output=part.output / unit, unit=unit) for part in parts]
    return [*alone, *further]


def labels(records: Sequence[Record]) -> list[str]:
    """Return the names of the further outputs that any of some recordings has."""
    return list(dict.fromkeys(channel.label for record in records for channel in record.channels))


def leads(records: Sequence[Record]) -> tuple[int, ...]:
    """Return where in a sequence the recording stands that each is, or is a further output of."""
    place = {id(record): i for i, record in enumerate(records)}
    return tuple(place.get(id(record.lead), i) for i, record in enumerate(records))


def by_output(records: Sequence[Record]) -> list[slice]:
    """Return where the recordings of each output stand in a list that has one output after the other."""
    names = [record.label for record in records]
    firsts = [i for i, name in enumerate(names) if i == 0 or name != names[i - 1]]
    return [slice(first, end) for first, end in pairwise([*firsts, len(names)])]


def _alone(record: Record, channel: Channel, lead: Record) -> Record:
    return replace(
        record,
        name=f"{record.name}:{channel.label}",
        output=np.where(channel.okay, channel.output, 0.0),
        okay=channel.okay & record.okay,
        kind=channel.kind,
        location=channel.location,
        channels=(),
        lead=lead,
        label=channel.label,
    )
