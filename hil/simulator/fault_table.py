"""Faults of the simulated devices: one table of them, and how a person writes them.

``m1.refuse_mode``, ``plc.clutch_closes@5.0``, ``m2.emcy@5.0=0x4210``, ``bus.lose=0.01``: device, kind, moment, size. A
moment is in seconds of simulated time, which passes with SYNC alone: a rig that nobody drives stands still.

A new fault is one row of `DEVICES`, and what it does in its device. The command line, its help, the tests and the
campaigns read the table.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from operator import attrgetter
from types import MappingProxyType
from typing import Any, Final

from drivers.inverter.cia402 import PowerState
from hil.errors import UsageError
from hil.simulator.faults import AtStep, Frames, PlcAnswers, RigFaults

OVERCURRENT: Final = 0x2310  # EMCY error code of CiA 402: continuous over current at the output
NOBODY: Final = (0xBAD, 0xBAD)  # vendor-ID and product code of no device

LAST_COB_ID: Final = 0x7FF

_STATES: Final = {
    "ready": PowerState.READY_TO_SWITCH_ON,
    "switched_on": PowerState.SWITCHED_ON,
    "quick_stop": PowerState.QUICK_STOP_ACTIVE,
    "disabled": PowerState.SWITCH_ON_DISABLED,
}

_SPEC = re.compile(r"(?P<device>\w+)\.(?P<kind>\w+)(?:@(?P<at_s>[^=]+))?(?:=(?P<size>.+))?")


@dataclass(frozen=True, slots=True)
class Moment:
    """When a fault comes, in simulated time [s], and its size; ``step`` is that SYNC, counted from 1."""

    at_s: float  # 0: from power-on
    period_s: float  # of the SYNC, by the rig file
    size: Any = None  # as `Size.read` returns it; None for a fault without one

    @property
    def step(self) -> int:
        """Number of the SYNC at that time; 0 from power-on."""
        return round(self.at_s / self.period_s)


@dataclass(frozen=True, slots=True)
class Size:
    """What stands after the ``=`` of a fault: its sign in help and messages, what it may be in words, how it is read.

    ``read`` raises ValueError for what it may not be; without a default it has to be given.
    """

    sign: str  # such as CODE
    expected: str  # continues "expected"
    read: Callable[[str], Any]
    default: Any = None  # None: it has to be given


@dataclass(frozen=True, slots=True)
class FaultKind:
    """One kind of fault: a row of the table; what it sets in its device's faults, a value or what makes it."""

    fields: Mapping[str, Any]  # by field (``a.b``: a field of a field) its value, or what makes it of a `Moment`
    size: Size | None = None  # None: it takes none
    timed: bool = False  # whether it takes a moment
    since_start: bool = False  # whether the moment may be left out: it is there from power-on then

    def put_into(self, faults: Any, when: Moment) -> Any:
        """Return a device's faults with this one among them."""
        for name, value in self.fields.items():
            faults = _with(faults, name, value(when) if callable(value) else value)
        return faults

    def adds_up(self, faults: Any) -> bool:
        """Whether it may come more than once, with other sizes."""
        return any(isinstance(getattr(faults, name, None), frozenset) for name in self.fields) and self.size is not None

    def written(self, name: str) -> str:
        """Write it as a person does: ``emcy@S=CODE``, in brackets what may be left out; S stands for seconds."""
        moment = "" if not self.timed else "[@S]" if self.since_start else "@S"
        if self.size is None:
            return name + moment
        size = f"={self.size.sign}"
        return name + moment + (size if self.size.default is None else f"[{size}]")


def _with(faults: Any, name: str, value: Any) -> Any:
    """Set one field; ``a.b`` is a field of a field."""
    head, _, tail = name.partition(".")
    before = getattr(faults, head)
    if tail:
        value = _with(before, tail, value)
    elif isinstance(before, frozenset):
        value = before | {value}
    return replace(faults, **{head: value})


def _number(sign: str, low: float, high: float, unit: str = "") -> Size:
    return Size(sign, f"a number from {low:g} to {high:g} {unit}".rstrip(), _between(float, low, high))


def _between(kind: Callable[[str], float], low: float, high: float) -> Callable[[str], Any]:
    def read(text: str) -> float:
        value = kind(text)
        if not low <= value <= high:  # False for nan, too
            raise ValueError(text)
        return value

    return read


_whole = partial(int, base=0)


def _code(sign: str, what: str, default: int | None = None) -> Size:
    return Size(sign, f"{what}, 0x1000 to 0xFFFF", _between(_whole, 0x1000, 0xFFFF), default)


def _frames(sign: str, high: float, unit: str) -> Size:
    """Describe an amount of the PDOs, or with ``:ID`` of the frames with one COB-ID."""

    def read(text: str) -> Frames:
        amount, colon, cob_id = text.partition(":")
        which = _between(_whole, 0, LAST_COB_ID)(cob_id) if colon else None
        return Frames(_between(float, 0.0, high)(amount), which)

    words = f"a number from 0 to {high:g} {unit}, and :ID for frames of one COB-ID that are no PDO"
    return Size(f"{sign}[:ID]", words, read)


def _state(text: str) -> PowerState:
    if text not in _STATES:
        raise ValueError(text)
    return _STATES[text]


_step, _size, _at_s = attrgetter("step"), attrgetter("size"), attrgetter("at_s")


def _at_step(when: Moment) -> AtStep[Any]:
    return AtStep(when.step, when.size)


def _answers(answers: PlcAnswers) -> FaultKind:
    return FaultKind({"answers_at_s": lambda when: (when.at_s, answers)}, timed=True)


_STATE = Size("STATE", f"a state: {', '.join(_STATES)}", _state, PowerState.SWITCHED_ON)
_FACTOR = _number("FACTOR", -10.0, 10.0, "times the torque asked for")
_PERMILLE = _number("PERMILLE", -1e3, 1e3, "of rated torque")
_SPEED_FACTOR = _number("FACTOR", -10.0, 10.0, "times the speed")
_EVERY = Size("N", "a whole number from 1 to 1000: at every N-th SYNC", _between(_whole, 1, 1000), 1)
_INDEX = _code("INDEX", "an object")
_COOLING = _number("PERMILLE", 1.0, 1e3, "of rated torque")
_COARSE = _number("PERMILLE", 1.0, 100.0, "of rated torque")

_INVERTER: Final[Mapping[str, FaultKind]] = MappingProxyType(
    {
        "absent": FaultKind({"absent": True}),
        "wrong_identity": FaultKind({"identity": NOBODY}),
        "refuse_mode": FaultKind({"ignored_writes": 0x6060}),
        "stuck": FaultKind({"ignored_writes": 0x6040}),
        "hang": FaultKind({"hang_at_step": _step}, timed=True),
        "reset": FaultKind({"reset_at_step": _step}, timed=True),
        "bus_off": FaultKind({"bus_off_at_step": _step}, timed=True),
        "stale_pdo": FaultKind({"stale_from_step": _step}, timed=True),
        "ignores_target": FaultKind({"ignores_target_from_step": _step}, timed=True),
        "leaves_operation": FaultKind({"leaves_operation": _at_step}, _STATE, True),
        "torque_gain": FaultKind({"wrong_torque.step": _step, "wrong_torque.gain": _size}, _FACTOR, True),
        "torque_offset": FaultKind(
            {"wrong_torque.step": _step, "wrong_torque.offset_permille": _size}, _PERMILLE, True
        ),
        "speed_gain": FaultKind({"wrong_speed.gain_from_step": _step, "wrong_speed.gain": _size}, _SPEED_FACTOR, True),
        "speed_stuck": FaultKind({"wrong_speed.stuck_from_step": _step}, timed=True),
        "second_tpdo": FaultKind({"second_tpdo": _at_step}, _EVERY, True),
        "stale_share": FaultKind({"stale_share": _size}, _number("SHARE", 0.0, 1.0, "of the PDOs")),
        "fault": FaultKind({"fault": _at_step}, _code("CODE", "an error code", OVERCURRENT), True),
        "emcy": FaultKind({"emcy": _at_step}, _code("CODE", "an error code"), True),
        "brown_out": FaultKind({"brown_out_at_step": _step}, timed=True),
        "clock_drift": FaultKind({"clock_drift_ppm": _size}, _number("PPM", -1e5, 1e5, "parts per million")),
        "forgets": FaultKind({"ignored_writes": _size}, _INDEX),
        "lacks": FaultKind({"missing_objects": _size}, _INDEX),
        "locks": FaultKind({"locked_objects": _size}, _INDEX),
        "field_weakening": FaultKind({"limits.base_speed_rad_s": _size}, _number("RAD_S", 1.0, 1e4, "rad/s")),
        "weak_cooling": FaultKind({"limits.continuous_permille": _size}, _COOLING),
        "coarse_torque": FaultKind({"limits.torque_step_permille": lambda when: round(when.size)}, _COARSE),
    }
)

DEVICES: Final[Mapping[str, Mapping[str, FaultKind]]] = MappingProxyType(
    {
        "m1": _INVERTER,
        "m2": _INVERTER,
        "bus": {
            **{
                name: FaultKind({name: _at_step}, _frames("SHARE", 1.0, "of all"), True, True)
                for name in ("lose", "corrupt", "repeat", "reorder")
            },
            **{
                name: FaultKind({name: _at_step}, _frames("SECONDS", 10.0, "s"), True, True)
                for name in ("delay", "jitter")
            },
            "off": FaultKind({"off_at_step": _step}, timed=True),
            "swapped_nodes": FaultKind({"swapped_nodes": True}),
        },
        "plc": {
            "clutch_closes": FaultKind({"clutch_closes_at_s": _at_s}, timed=True),
            "permissive_withdrawn": FaultKind({"permissive_withdrawn_at_s": _at_s}, timed=True),
            "mode_changes": FaultKind({"mode_changes_at_s": _at_s}, timed=True),
            "hang": _answers(PlcAnswers.NOT),
            "exception": _answers(PlcAnswers.EXCEPTION),
            "slow": _answers(PlcAnswers.LATE),
            "half_answer": _answers(PlcAnswers.HALF),
            "reset": _answers(PlcAnswers.RESET),
            "wrong_unit": _answers(PlcAnswers.WRONG_UNIT),
            "wrong_transaction": _answers(PlcAnswers.WRONG_TRANSACTION),
            "swapped_floats": FaultKind({"swaps_floats": True}),
            "wrong_width": _answers(PlcAnswers.TOO_FEW),
        },
    }
)
"""Every fault that can be asked for, by device and name."""


def known_faults() -> str:
    """List every fault in the way it is written, for help and messages; S stands for seconds."""
    written = {
        device: ", ".join(kind.written(name) for name, kind in kinds.items()) for device, kinds in DEVICES.items()
    }
    return f"m1.X or m2.X, X being {written['m1']}; bus.X, X being {written['bus']}; plc.X, X being {written['plc']}"


def rig_faults(texts: Iterable[str], period_s: float) -> RigFaults:
    """Read faults ``DEVICE.KIND[@S][=SIZE]``, as given to ``hil sim --fault``."""
    faults = RigFaults()
    known: set[tuple[str, str, Any]] = set()
    for text in texts:
        match = _SPEC.fullmatch(text.strip())
        device, name, at_s, size = match.group("device", "kind", "at_s", "size") if match else ("", "", None, None)
        kind = DEVICES.get(device, {}).get(name)
        if kind is None:
            raise UsageError(f"fault {text!r}: expected one of {known_faults()}.")
        moment = Moment(_seconds(text, kind, at_s), period_s, _asked_size(text, kind, size))
        before = getattr(faults, device)
        once = (device, name, moment.size if kind.adds_up(before) else None)
        if once in known:
            raise UsageError(f"fault {text!r}: expected {device}.{name} once, got twice. Leave one out.")
        known.add(once)
        faults = replace(faults, **{device: kind.put_into(before, moment)})
    return faults


def _seconds(text: str, kind: FaultKind, at_s: str | None) -> float:
    if at_s is None:
        if kind.timed and not kind.since_start:
            name = text.strip().partition("=")[0]
            raise UsageError(f"fault {text!r}: expected a moment in seconds, got none. Write {name}@5.0")
        return 0.0
    if not kind.timed:
        raise UsageError(f"fault {text!r}: expected no moment, got {at_s!r}: it is there from the start.")
    try:
        value = float(at_s)
    except ValueError:
        value = math.nan
    if not 0.0 <= value < math.inf:
        raise UsageError(f"fault {text!r}: expected seconds of simulated time, 0 or more, got {at_s!r}.")
    return value


def _asked_size(text: str, kind: FaultKind, given: str | None) -> Any:
    size = kind.size
    if size is None:
        if given is not None:
            raise UsageError(f"fault {text!r}: expected nothing after its name, got '={given}'.")
        return None
    if given is None:
        if size.default is None:
            device, _, name = text.strip().partition("@")[0].partition(".")
            raise UsageError(f"fault {text!r}: expected {size.expected}, got none. Write {device}.{kind.written(name)}")
        return size.default
    try:
        return size.read(given)
    except ValueError as error:
        raise UsageError(f"fault {text!r}: expected {size.expected}, got {given!r}.") from error
