"""What a new rig file needs to know, one row per question; nothing that limits torque has a default on a vehicle.

The command line has an option of each question's name; what is not given there is asked.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from drivers.inverter.cia402 import TorqueMode

Value = str | int | float
Answers = Mapping[str, Value]

MODES: Final = tuple(mode.name.lower() for mode in TorqueMode)
USUAL_MODE: Final = TorqueMode.CYCLIC_SYNCHRONOUS_TORQUE.name.lower()


class NotAnAnswer(Exception):
    """An answer does not fit; the text says what would."""


@dataclass(frozen=True, slots=True)
class Question:
    """One question.

    Attributes
    ----------
    name : str
        Key among the answers, and the option's name.
    asks : str
        What is asked, unit included.
    read : callable
        Turns text into the value, given the answers before it; raises `NotAnAnswer`.
    simulated : str
        Answer for the simulated rig of ``hil sim``.
    vehicle : str
        Default on a vehicle; empty where there is none and a person has to know.
    """

    name: str
    asks: str
    read: Callable[[str, Answers], Value]
    simulated: str
    vehicle: str = ""

    @property
    def option(self) -> str:
        """The option on the command line."""
        return "--" + self.name.replace("_", "-")

    def default(self, simulated: bool) -> str:
        """Return the answer that stands if none is given."""
        return self.simulated if simulated else self.vehicle


def _text(text: str, _: Answers) -> str:
    if not text:
        raise NotAnAnswer("a text that is not empty")
    return text


def _url(text: str, _: Answers) -> str:
    scheme, colon, rest = text.partition(":")
    if not (scheme.isidentifier() and colon and rest):
        raise NotAnAnswer("INTERFACE:CHANNEL, such as socketcan:can0, pcan:PCAN_USBBUS1 or ws://127.0.0.1:54701/")
    return text


def _host_port(text: str, _: Answers) -> str:
    host, colon, port = text.rpartition(":")
    if not (host and colon and port.isdecimal() and 1 <= int(port) <= 65535):
        raise NotAnAnswer("HOST:PORT with a port from 1 to 65535, such as 192.168.0.10:502")
    return text


def _whole(low: int, high: int) -> Callable[[str, Answers], int]:
    def read(text: str, _: Answers) -> int:
        try:
            value = int(text, 0)
        except ValueError:
            value = low - 1
        if not low <= value <= high:
            raise NotAnAnswer(f"a whole number from {low} to {high}; 0x makes it hexadecimal")
        return value

    return read


def _node_m2(text: str, before: Answers) -> int:
    value = _whole(1, 127)(text, before)
    if value == before.get("node_m1"):
        raise NotAnAnswer(f"another node than m1 ({value})")
    return value


def _number(low: float, high: float, expected: str) -> Callable[[str, Answers], float]:
    def read(text: str, _: Answers) -> float:
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not (low < value <= high and math.isfinite(value)):
            raise NotAnAnswer(expected)
        return value

    return read


def _positive(unit: str) -> Callable[[str, Answers], float]:
    return _number(0.0, 1e9, f"a number above 0 [{unit}]")


def _torque_limit(text: str, before: Answers) -> float:
    value = _positive("Nm")(text, before)
    rated = before.get("rated_torque_nm")
    if isinstance(rated, float) and value > rated:
        raise NotAnAnswer(f"at most the rated torque ({rated:g} Nm)")
    return value


def _mode(text: str, _: Answers) -> str:
    if text not in MODES:
        raise NotAnAnswer(" or ".join(MODES))
    return text


def _period(text: str, _: Answers) -> float:
    value = _number(0.0, 1.0, "a period from 0.001 to 1 s")(text, {})
    if value < 0.001:
        raise NotAnAnswer("a period from 0.001 to 1 s")
    return value


QUESTIONS: Final[tuple[Question, ...]] = (
    Question("name", "Name of the rig, for people", _text, "simulated bus", "vehicle"),
    Question("can", "CAN bus, INTERFACE:CHANNEL", _url, "ws://127.0.0.1:54701/", "socketcan:can0"),
    Question("period_s", "SYNC period [s]", _period, "0.01", "0.01"),
    Question("plc", "PLC, HOST:PORT", _host_port, "127.0.0.1:5020"),
    Question("node_m1", "CANopen node of inverter m1, 1 to 127", _whole(1, 127), "1", "1"),
    Question("node_m2", "CANopen node of inverter m2, 1 to 127", _node_m2, "2", "2"),
    Question("vendor_id", "Vendor ID of both inverters, object 0x1018:1", _whole(0, 0xFFFF_FFFF), "0x3E7"),
    Question("product_code", "Product code of both inverters, object 0x1018:2", _whole(0, 0xFFFF_FFFF), "0x402"),
    Question("mode", f"Mode of operation: {' or '.join(MODES)}", _mode, USUAL_MODE, USUAL_MODE),
    Question("rated_torque_nm", "Rated torque of one inverter, object 0x6076 [Nm]", _positive("Nm"), "600.0"),
    Question("torque_limit_nm", "Most torque one inverter may ever give here [Nm]", _torque_limit, "400.0"),
    Question("inertia_kg_m2", "Vehicle and driveline at the motor shaft [kg m^2]", _positive("kg m^2"), "100.0"),
    Question("speed_rad_s", "Motor speed of the cruise [rad/s]", _positive("rad/s"), "60.0"),
)
"""In the order in which they are asked."""

BY_NAME: Final[Mapping[str, Question]] = MappingProxyType({question.name: question for question in QUESTIONS})
