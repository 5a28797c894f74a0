"""A new rig file, from a few answers: what is asked, how it is answered, what a data sheet answers, and the text.

Nothing that limits torque has a default on a vehicle. The command line has an option of each question's name; what is
not given there is asked. Limits and experiments are in proportion to the torque limit, as in ``examples/rig.toml``,
where they hold together: with T the torque limit of one inverter, both share a PRBS of 0.3 T, and 1.25 T of base torque
leave it room under every limit, also where one inverter gives 65 % of it. Rates are per second.
"""

from __future__ import annotations

import os
import re
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from string import Template
from types import MappingProxyType
from typing import Annotated, Any, Final, Literal

from pydantic import AfterValidator, BeforeValidator, Field, TypeAdapter, ValidationError

from drivers.capability.plan import DrivePlan
from drivers.capability.table import Function
from drivers.datasheet.text import EdsSection, Severity, read_eds_text
from drivers.datasheet.types import read_number
from drivers.eds_check import EdsReport, check_eds
from drivers.eds_check.needs import RigLine, usual_mode
from drivers.inverter.cia402 import TorqueMode
from hil.config.rig_file import Rig
from hil.config.table import Text
from hil.errors import InputError, RigFileError, UsageError
from hil.problems import validate

Value = str | int | float
GivenValues = Mapping[str, Value]

MODES: Final = tuple(mode.name.lower() for mode in TorqueMode)
USUAL_MODE: Final = TorqueMode.CYCLIC_SYNCHRONOUS_TORQUE.name.lower()

SIMULATED_ACCEPTANCE = '{ by = "hil rig new --simulated", why = "simulated drives: no shaft turns" }'

PARTS_OF_LIMIT: Final = {
    "rate_limit": 5.0,
    "prbs_limit": 0.3,
    "sum_limit": 1.75,
    "prbs_amplitude": 0.3,
    "torque": 1.25,
    "cruise_slew": 2.5,
    "reversal_slew": 5.0,
    "tip_slew": 7.5,
    "swing": 0.625,
    "step": 0.75,
}
"""Torques and rates in parts of one inverter's torque limit."""

TIP_SPEED: Final = 2.0 / 3.0
"""Speed of the tips in parts of the cruise's."""

COMMENTS_AT: Final = 41
"""Column in which comments begin."""

HEXADECIMAL: Final = ("vendor_id", "product_code")

OWN_EDS: Final = "# eds ="
"""Beginning of the template's line that shows how to name an EDS."""

HEARTBEAT: Final = "heartbeat_ms ="
"""Beginning of the template's line of each inverter that what its data sheet makes necessary comes after."""


class NotAnAnswer(Exception):
    """An answer does not fit; the text says what would."""


@dataclass(frozen=True, slots=True)
class AnswerKind:
    """What an answer has to be: its type, as pydantic reads it from text, and the same in words."""

    type: Any  # an annotation that pydantic validates by
    fits: str  # what the text has to be, for the message; continues "expected"

    def read(self, text: str) -> Value:
        """Return the value that a text stands for; `NotAnAnswer` where it is none of this kind."""
        try:
            value: Value = TypeAdapter(self.type).validate_python(text)
        except ValidationError as error:
            raise NotAnAnswer(self.fits) from error
        return value


def _whole(low: int, high: int) -> AnswerKind:
    any_base = BeforeValidator(lambda text: int(text, 0))
    fits = f"a whole number from {low} to {high}; 0x makes it hexadecimal"
    return AnswerKind(Annotated[int, any_base, Field(ge=low, le=high)], fits)


def _positive(unit: str) -> AnswerKind:
    return AnswerKind(Annotated[float, Field(gt=0.0, le=1e9)], f"a number above 0 [{unit}]")


def _with_port(text: str) -> str:
    host, colon, port = text.rpartition(":")
    if not (host and colon and port.isdecimal() and 1 <= int(port) <= 65535):
        raise ValueError(text)
    return text


TEXT: Final = AnswerKind(Text, "a text that is not empty")
URL: Final = AnswerKind(
    Annotated[str, Field(pattern=r"^[^\W\d]\w*:.")],
    "INTERFACE:CHANNEL, such as socketcan:can0, pcan:PCAN_USBBUS1 or ws://127.0.0.1:54701/",
)
HOST_PORT: Final = AnswerKind(
    Annotated[str, AfterValidator(_with_port)], "HOST:PORT with a port from 1 to 65535, such as 192.168.0.10:502"
)
PERIOD: Final = AnswerKind(Annotated[float, Field(ge=0.001, le=1.0)], "a period from 0.001 to 1 s")
NODE: Final = _whole(1, 127)
UNSIGNED32: Final = _whole(0, 0xFFFF_FFFF)
MODE: Final = AnswerKind(Literal[MODES], " or ".join(MODES))


@dataclass(frozen=True, slots=True)
class Question:
    """One question."""

    name: str  # key among the answers, and the option's name
    asks: str  # what is asked, unit included
    kind: AnswerKind  # what an answer has to be
    simulated: str  # answer for the simulated rig of ``hil sim``
    vehicle: str = ""  # default on a vehicle

    @property
    def option(self) -> str:
        """The option on the command line."""
        return "--" + self.name.replace("_", "-")

    def default(self, simulated: bool) -> str:
        """Return the answer that stands if none is given."""
        return self.simulated if simulated else self.vehicle

    def read(self, text: str, before: GivenValues) -> Value:
        """Return the value, given the answers before it."""
        value, rated_nm = self.kind.read(text), before.get("rated_torque_nm")
        if self.name == "node_m2" and value == before.get("node_m1"):
            raise NotAnAnswer(f"another node than m1 ({value})")
        if self.name == "torque_limit_nm" and isinstance(rated_nm, float) and float(value) > rated_nm:
            raise NotAnAnswer(f"at most the rated torque ({rated_nm:g} Nm)")
        return value


QUESTIONS: Final[tuple[Question, ...]] = (
    Question("name", "Name of the rig, for people", TEXT, "simulated bus", "vehicle"),
    Question("can", "CAN bus, INTERFACE:CHANNEL", URL, "ws://127.0.0.1:54701/", "socketcan:can0"),
    Question("period_s", "SYNC period [s]", PERIOD, "0.01", "0.01"),
    Question("plc", "PLC, HOST:PORT", HOST_PORT, "127.0.0.1:5020"),
    Question("node_m1", "CANopen node of inverter m1, 1 to 127", NODE, "1", "1"),
    Question("node_m2", "CANopen node of inverter m2, 1 to 127", NODE, "2", "2"),
    Question("vendor_id", "Vendor ID of both inverters, object 0x1018:1", UNSIGNED32, "0x3E7"),
    Question("product_code", "Product code of both inverters, object 0x1018:2", UNSIGNED32, "0x402"),
    Question("mode", f"Mode of operation: {' or '.join(MODES)}", MODE, USUAL_MODE, USUAL_MODE),
    Question("rated_torque_nm", "Rated torque of one inverter, object 0x6076 [Nm]", _positive("Nm"), "600.0"),
    Question("torque_limit_nm", "Most torque one inverter may ever give here [Nm]", _positive("Nm"), "400.0"),
    Question("inertia_kg_m2", "Vehicle and driveline at the motor shaft [kg m^2]", _positive("kg m^2"), "100.0"),
    Question("speed_rad_s", "Motor speed of the cruise [rad/s]", _positive("rad/s"), "60.0"),
)
"""In the order in which they are asked."""

BY_NAME: Final[Mapping[str, Question]] = MappingProxyType({question.name: question for question in QUESTIONS})


Ask = Callable[[str, str, str], str]
"""Asks a person: what for, its default (empty: none), what was wrong with the answer before (empty: nothing)."""


def answers(
    given: Mapping[str, str], simulated: bool, ask: Ask | None = None, known: Mapping[str, str] | None = None
) -> GivenValues:
    """Return an answer to every question."""
    found: dict[str, Value] = {}
    faults: list[str] = []
    for question in QUESTIONS:
        default = (known or {}).get(question.name, question.default(simulated))
        if question.name not in given and ask is not None:
            if not faults:
                found[question.name] = _asked(question, default, found, ask)
            continue
        text = given.get(question.name, default)
        if not text and question.name not in given:
            faults.append(f"{question.option} | expected {question.asks}: no default on a vehicle | got nothing")
            continue
        try:
            found[question.name] = question.read(text.strip(), found)
        except NotAnAnswer as fits:
            faults.append(f"{question.option} | expected {fits} | got {text!r}")
    if faults:
        raise UsageError("\n".join(faults))
    return found


def _asked(question: Question, default: str, found: GivenValues, ask: Ask) -> Value:
    wrong = ""
    while True:
        text = ask(question.asks, default, wrong).strip() or default
        try:
            return question.read(text, found)
        except NotAnAnswer as fits:
            wrong = f"expected {fits}, got {text!r}" if text else f"expected {fits}: there is no default"


@dataclass(frozen=True, slots=True)
class NewDrive:
    """Both inverters of a new rig file, by their data sheet."""

    defaults: Mapping[str, str]  # answers to the questions, by name
    lines: tuple[str, ...]  # lines for ``[inverters.m1]`` and ``[inverters.m2]``, comments included
    report: EdsReport  # what the check of the file said


def new_drive(eds: Path, rig_file: Path, simulated: bool) -> NewDrive:
    """Read a drive's data sheet for a new rig file."""
    report = check_eds(eds)
    if report.plan is None or not report.usable:
        first = next(each for each in report.findings if each.severity is Severity.ERROR)
        line = "" if first.line is None else f"line {first.line}, "
        raise InputError(f"EDS {eds} is not usable: {line}{first} For all of it: hil check --eds {eds}")
    defaults = {
        **_identity(report.plan, eds),
        **_commissioned(report.plan),
        "mode": usual_mode(report.plan).name.lower(),
    }
    if simulated:
        defaults = {**_simulated(report.plan), **defaults}
    path = os.path.relpath(eds.resolve(), rig_file.resolve().parent)
    lines = (f'eds = "{Path(path).as_posix()}"  # relative to this file', *_lines(report, simulated))
    return NewDrive(defaults, lines, report)


def _identity(plan: DrivePlan, eds: Path) -> dict[str, str]:
    """Take vendor and product from object 0x1018, or else from what the file says of the device."""
    section = read_eds_text(eds).section("DeviceInfo")
    keys = (("vendor_id", 1, "VendorNumber"), ("product_code", 2, "ProductNumber"))
    found = {name: _stated(plan.sheet.value(0x1018, subindex), section, key) for name, subindex, key in keys}
    return {name: f"0x{value:X}" for name, value in found.items() if value is not None}


def _stated(value: int | None, section: EdsSection | None, key: str) -> int | None:
    return value if value is not None or section is None else read_number(section.get(key) or "")


def _commissioned(plan: DrivePlan) -> dict[str, str]:
    """Take node id and bit rate from a DCF."""
    commissioning = plan.sheet.commissioning
    if commissioning is None:
        return {}
    found = {}
    node = commissioning.node_id
    if node is not None:
        found = {"node_m1": str(node), "node_m2": str(node + 1 if node < 127 else node - 1)}
    if commissioning.bit_rate_kbit_s is not None:
        found["can"] = f"socketcan:can0?bitrate={1000 * commissioning.bit_rate_kbit_s}"
    return found


def _simulated(plan: DrivePlan) -> dict[str, str]:
    """Keep a simulated rig within the max torque the drives are simulated with, and its cruise within that torque."""
    usual_nm, rated_nm = (float(BY_NAME[name].simulated) for name in ("torque_limit_nm", "rated_torque_nm"))
    values = [plan.sheet.value(part.index) for part in plan.abilities[Function.MAXIMUM_TORQUE].parts]
    known = [abs(value) for value in values if value]  # 0 is a place left free
    limit_nm = min(usual_nm, *(value * rated_nm / 1000.0 for value in known)) if known else usual_nm
    speed = float(BY_NAME["speed_rad_s"].simulated) * limit_nm / usual_nm
    return {"product_code": "0", "torque_limit_nm": f"{limit_nm:g}", "speed_rad_s": f"{speed:g}"}


def _lines(report: EdsReport, simulated: bool) -> Iterator[str]:
    for line in report.lines:
        if line.key == "mode":
            continue
        if simulated and line.key.startswith("accepted."):
            yield f"{line.key} = {SIMULATED_ACCEPTANCE}  # {line.reason}"
        elif simulated or not _is_guess(line):
            yield f"{line.text}  # {line.reason}"
        else:
            yield f"# {line.text}  # {line.reason}"
    rated = None if report.plan is None else report.plan.sheet.commissioned(0x6076)
    if rated:
        yield f"# 0x6076 is {rated} in the DCF: {rated / 1000:g} Nm if in mNm; some drives have uNm: rated_torque_unit"


def _is_guess(line: RigLine) -> bool:
    """Whether a person has to fill the line in."""
    return line.key == "speed_unit" or line.key.startswith("accepted.")


def rig_text(answers: GivenValues, file: Path, simulated: bool, drive_lines: Sequence[str] = ()) -> str:
    """Return the file, checked as any rig file is."""
    template = (files("hil.config") / "new_rig.toml").read_text(encoding="utf-8")
    if not simulated:
        template = template.partition("\n[simulation]")[0]
    filled = _filled(answers, file.name)
    lines = [_line(line, filled) for line in template.splitlines()]
    text = "".join(f"{line}\n" for line in (_with_drive(lines, drive_lines) if drive_lines else lines))
    validate(Rig, tomllib.loads(text), file, RigFileError)
    return text


def _with_drive(lines: Sequence[str], drive_lines: Sequence[str]) -> Iterator[str]:
    """Put the drive's own lines into both inverters' tables; a heartbeat of its own takes the place of the usual."""
    own_heartbeat = any(line.startswith(HEARTBEAT) for line in drive_lines)
    for line in lines:
        if not (line.startswith(OWN_EDS) or (own_heartbeat and line.startswith(HEARTBEAT))):
            yield line
        if line.startswith(HEARTBEAT):
            yield from drive_lines


def _filled(answers: GivenValues, file_name: str) -> dict[str, str]:
    host, _, port = str(answers["plc"]).rpartition(":")
    limit_nm = float(answers["torque_limit_nm"])
    values: dict[str, Value] = {
        **answers,
        "plc_host": host,
        "plc_port": int(port),
        "tip_speed": _rounded(TIP_SPEED * float(answers["speed_rad_s"])),
        **{name: _rounded(part * limit_nm) for name, part in PARTS_OF_LIMIT.items()},
    }
    return {name: _written(name, value) for name, value in values.items()} | {"file_name": file_name}


def _rounded(value: float) -> float:
    """Round to a millionth of the value: products of short numbers stay short."""
    return float(f"{value:.6g}")


def _written(name: str, value: Value) -> str:
    if isinstance(value, str):
        return '"' + re.sub(r'["\\\x00-\x1f\x7f]', lambda match: f"\\u{ord(match[0]):04X}", value) + '"'
    return f"0x{value:X}" if name in HEXADECIMAL else repr(value)


def _line(line: str, filled: dict[str, str]) -> str:
    """Fill in one line of the template and put its comment, if it has one, into its column."""
    key, space, comment = line.partition("  #")
    code = Template(key).substitute(filled)
    if not space:
        return code
    return f"{code.rstrip():<{COMMENTS_AT - 1}} #{Template(comment).substitute(filled)}"
