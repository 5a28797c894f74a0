"""What a register of the PLC holds, and whether it can be: a value that no vehicle has is one that was misread.

The usual cause is the order of the two words of a 32-bit value, which Modbus leaves to the maker: 350 Nm read in the
other order is 2.4e-41 Nm, or a billion. Neither would hold a torque back.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from drivers.errors import ProtocolViolation
from drivers.plc.map_needs import USED, to_si
from drivers.plc.register import Register, Value, WordOrder

PLAUSIBLE: Final[Mapping[str, tuple[float, float]]] = MappingProxyType(
    {
        "speed_limit": (0.1, 1e4),
        "torque_limit": (0.1, 1e5),
        "prbs_torque": (-1e5, 1e5),
        "prbs_amplitude": (0.01, 1e5),
        "prbs_divider": (1, 1e6),
        "prbs_seed": (1, 1023),
        "host_count_seen": (0, 65535),
    }
)
"""Least and greatest value a vehicle may have, in the unit the driver works in; 0 may be everywhere: nothing is set."""

LEAST_TORQUE_NM: Final = 1e-6
"""A torque below this and not zero is no torque but a misread number [Nm]."""


@dataclass(frozen=True, slots=True)
class Reading:
    """One register as it was read.

    Attributes
    ----------
    name, register
        Which it is.
    value
        What it holds, in the register's own unit; None where it could not be read, or means nothing.
    problem
        Why the value can't be believed; None where it can.
    expected
        What it should be, where there is a problem.
    """

    name: str
    register: Register
    value: Value | None
    problem: str | None = None
    expected: str = ""

    @property
    def shown(self) -> str:
        """The value in words, without its unit."""
        if self.value is None:
            return "–"
        return f"{self.value:.7g}" if isinstance(self.value, float) else str(self.value).lower()

    @property
    def unit(self) -> str:
        """The register's unit; empty for counts, states and bits."""
        return "" if self.register.unit == "1" else self.register.unit

    def required(self) -> Value:
        """Give the value in the unit the driver works in."""
        if self.problem is not None or self.value is None:
            raise ProtocolViolation(
                f"register {self.name} ({self.register.kind.value} {self.register.address}): expected {self.expected}, "
                f"got {self.problem}"
            )
        return to_si(self.name, self.register, self.value)


def reading(name: str, register: Register, words: Sequence[int]) -> Reading:
    """Make a value of words, and judge it."""
    try:
        value = register.decode(words)
    except ProtocolViolation as error:
        return Reading(name, register, None, str(error), "a value of its type")
    if is_plausible(name, register, value):
        return Reading(name, register, value)
    unit = f" {register.unit}" if register.unit != "1" else ""
    problem = f"{value:.7g}{unit}. {_advice(name, register, words)}"
    return Reading(name, register, value, problem, _range(name))


def is_plausible(name: str, register: Register, value: Value) -> bool:
    """Whether a vehicle may have such a value; what nothing is known of may be anything."""
    if name not in PLAUSIBLE or isinstance(value, str):
        return True
    low, high = PLAUSIBLE[name]
    number = float(to_si(name, register, value))
    return number == 0.0 or (low <= number <= high and abs(number) > LEAST_TORQUE_NM)


def _range(name: str) -> str:
    low, high = PLAUSIBLE[name]
    unit = USED[name][1]
    return f"0, or {low:g} to {high:g}{'' if unit == '1' else f' {unit}'}"


def _advice(name: str, register: Register, words: Sequence[int]) -> str:
    """Say what the value would be with the words in the other order, where that makes one."""
    if register.word_order is not None:
        order = next(each for each in WordOrder if each is not register.word_order)
        other = register.model_copy(update={"word_order": order})
        try:
            value = other.decode(words)
        except ProtocolViolation:
            value = None
        if value is not None and not isinstance(value, str) and is_plausible(name, other, value):
            return f"With word_order = {order.value!r} in the register map it would be {value:.7g} {register.unit}."
    return "Compare address, type, scale and word order in the register map with the PLC's program."
