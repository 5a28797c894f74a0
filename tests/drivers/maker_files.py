"""Small data sheets in the styles of makers: written by the tests, for the makers' own files stay outside the project.

Each has the habits of one maker's file that mattered: what is missing, constant, blank, of another type, at another
transmission type, with another node's identifiers.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

U8, U16, U32, I8, I16, I32 = 5, 6, 7, 2, 3, 4


@dataclass(frozen=True)
class Entry:
    """One value: type, access, default as written, whether it may be mapped, ParameterValue of a DCF."""

    kind: int
    access: str = "rw"
    default: str = ""
    mappable: int = 0
    parameter: str | None = None

    def text(self, section: str, name: str) -> str:
        parameter = "" if self.parameter is None else f"ParameterValue={self.parameter}\n"
        return (
            f"[{section}]\nParameterName={name}\nObjectType=0x7\nDataType=0x{self.kind:04X}\nAccessType={self.access}\n"
            f"DefaultValue={self.default}\n{parameter}PDOMapping={self.mappable}\n\n"
        )


Described = Entry | dict[int, Entry]


@dataclass(frozen=True)
class Maker:
    """One file: its objects, its header, and what its text is turned into at last."""

    objects: Mapping[int, Described]
    header: str = "[FileInfo]\nFileName=x\n\n[DeviceInfo]\nVendorNumber=0x1234\nProductNumber=0x42\nGranularity=8\n\n"
    suffix: str = ".eds"
    lines: tuple[str, ...] = ()
    habit: Callable[[str], str] = field(default=lambda text: text)

    def text(self) -> str:
        return self.habit(self.header + "".join(_section(index, each) for index, each in sorted(self.objects.items())))

    def but(self, *gone: int, **changes: object) -> Maker:
        """Take objects out, and change the rest of it."""
        kept = {index: each for index, each in self.objects.items() if index not in gone}
        return replace(self, **{"objects": kept, **changes})  # type: ignore[arg-type]

    def having(self, objects: Mapping[int, Described]) -> Maker:
        return replace(self, objects={**self.objects, **objects})


def _section(index: int, each: Described) -> str:
    if isinstance(each, Entry):
        return each.text(f"{index:04X}", f"object {index:04X}")
    head = f"[{index:04X}]\nParameterName=object {index:04X}\nObjectType=0x9\nSubNumber={len(each)}\n\n"
    return head + "".join(entry.text(f"{index:04X}sub{n:X}", f"entry {n}") for n, entry in each.items())


def pdo(cob_id: str, kind: str, *entries: str, count: str | None = None, room: int = 8) -> tuple[Described, Described]:
    """Communication and mapping parameter of a PDO that can be written."""
    written = count if count is not None else str(len(entries))
    mapping = {0: Entry(U8, default=written)} | {
        n: Entry(U32, default=entries[n - 1] if n <= len(entries) else "") for n in range(1, room + 1)
    }
    return {0: Entry(U8, "ro", "2"), 1: Entry(U32, default=cob_id), 2: Entry(U8, default=kind)}, mapping


def pdos(base: int, *each: tuple[Described, Described]) -> dict[int, Described]:
    """Number PDOs from 0x1400 or 0x1800 on."""
    return {
        index: described
        for n, pair in enumerate(each)
        for index, described in zip((base + n, base + 0x200 + n), pair, strict=True)
    }


COMPLETE = Maker(
    {
        0x1000: Entry(U32, "ro", "0x00020192"),
        0x1001: Entry(U8, "ro", "0"),
        0x1005: Entry(U32, default="0x80"),
        0x1014: Entry(U32, default="$NODEID+0x80"),
        0x1016: {0: Entry(U8, "ro", "1"), 1: Entry(U32, default="0")},
        0x1017: Entry(U16, default="0"),
        0x1018: {0: Entry(U8, "ro", "2"), 1: Entry(U32, "ro", "0x1234"), 2: Entry(U32, "ro", "0x42")},
        0x6007: Entry(I16, default="1"),
        0x603F: Entry(U16, "ro", "", 1),
        0x6040: Entry(U16, "rww", "0", 1),
        0x6041: Entry(U16, "ro", "", 1),
        0x605A: Entry(I16, default="2"),
        0x6060: Entry(I8, "rww", "0", 1),
        0x6061: Entry(I8, "ro", "", 1),
        0x6064: Entry(I32, "ro", "", 1),
        0x606C: Entry(I32, "ro", "", 1),
        0x6071: Entry(I16, "rww", "0", 1),
        0x6072: Entry(U16, "rww", "1000", 1),
        0x6076: Entry(U32, "rw", "0"),
        0x6077: Entry(I16, "ro", "", 1),
        0x6087: Entry(U32, "rw", "0"),
        0x60A9: Entry(U32, "rw", "0x00B44700"),
        0x60B2: Entry(I16, "rww", "0", 1),
        0x60FF: Entry(I32, "rww", "0", 1),
        0x6502: Entry(U32, "ro", "0x3EF"),
        **pdos(0x1400, pdo("$NODEID+0x200", "255", "0x60400010"), pdo("$NODEID+0x80000300", "255", "0x60FF0020")),
        **pdos(0x1800, pdo("$NODEID+0x180", "255", "0x60410010"), pdo("$NODEID+0x280", "255", "0x60640020")),
    },
    lines=("accepted.rpdo_deadline",),
)
"""A servo drive as most makers describe one: velocity in its PDOs, event-driven, no deadline."""

DCF = "[DeviceComissioning]\nNodeID=1\nBaudrate=250\nNodeName=front\n\n"

ELMO = COMPLETE.but(0x1005, 0x60A9, suffix=".dcf", lines=("speed_unit", "accepted.rpdo_deadline")).having(
    {
        0x1029: {0: Entry(U8, "ro", "1"), 1: Entry(U8, default="1")},
        0x2013: Entry(0x1B, "ro", "", 1),
        0x6072: Entry(U16, default="50000"),
        0x6502: Entry(U32, "ro"),
        **pdos(0x1400, pdo("$NODEID+0x200", "1", "0x60400010", "0x60600008", count="")),
        **pdos(0x1800, pdo("$NODEID+0x180", "1", "0x60410010", count=""), pdo("$NODEID+0x280", "255", "0x20130040")),
    }
)
"""Blank counts of mapped objects, an object of 64 bits in another TPDO, no unit of speed."""

EPOS = COMPLETE.but(0x6072, 0x6087).having(
    {
        0x1005: Entry(U32, "const", "0x00000080"),
        0x1018: {0: Entry(U8, "ro", "4"), 1: Entry(U32, "ro"), 2: Entry(U32, "ro")},
        0x6502: Entry(U32, "ro"),
        **pdos(0x1800, pdo("$NODEID+0x40000180", "255", "0x60410010"), pdo("$NODEID+0xC0000280", "255", "0x606C0020")),
    }
)
"""A constant at the value wanted, identity blank, remote frames excluded."""

EPOS_DCF = EPOS.having(
    {
        0x1014: Entry(U32, "ro", "$NODEID+0x80", parameter="0x81"),
        0x6007: Entry(I16, default="1", parameter="3"),
        0x6076: Entry(U32, default="0", parameter="512871"),
        0x1400: {
            0: Entry(U8, "ro", "2"),
            1: Entry(U32, default="$NODEID+0x200", parameter="0x201"),
            2: Entry(U8, default="255", parameter="1"),
        },
    }
).but(suffix=".dcf", header=COMPLETE.header + DCF)
"""The same, commissioned as node 1: identifiers as numbers, option code and rated torque of its own."""

NANOTEC = COMPLETE.but(
    0x6076, habit=lambda text: text.replace("[FileInfo]", "[FileInfo]\nCreatedBy=M\xfcller").replace("\n", "\r\n")
).having({0x6072: Entry(U16, "rww", "0x0064", 1), 0x608F: {0: Entry(U8, "const", "2"), 1: Entry(I32), 2: Entry(I32)}})
"""Max torque of 10 %, no rated torque, a name in Latin-1, CR LF."""

SEVCON = COMPLETE.but(
    0x6007, 0x603F, 0x605A, 0x60A9, 0x60B2, lines=("mode", "accepted.rpdo_deadline", "accepted.abort_connection")
).having(
    {
        0x1005: Entry(U32, default="0x40000080"),
        0x1014: Entry(U32, default="0"),
        0x2120: Entry(1, "rw", "", 1),
        0x6087: Entry(U32, default="40000"),
        0x608B: Entry(I8, "ro", "0"),
        0x608C: Entry(U8, "ro", "0xA4"),
        0x6502: Entry(U32, "ro", "0x0000000C"),
        **pdos(0x1400, pdo("0x80000182", "255", "0x21200001"), pdo("0x282", "255", "0x21200001")),
        **pdos(0x1800, pdo("0x80000202", "1", "0x21200001"), pdo("0x302", "255", "0x21200001")),
    }
)
"""Produces SYNC, sends no EMCY, profile torque alone, identifiers of another node, flags of one bit."""

TECHNOSOFT = COMPLETE.but(
    0x1016,
    0x603F,
    0x6072,
    0x6076,
    0x60B2,
    lines=(
        "speed_unit",
        "option_codes.abort_connection",
        "accepted.supported_modes",
        "accepted.heartbeat_consumer",
        "accepted.rpdo_deadline",
    ),
).having({0x6007: Entry(I16, "rww", "0"), 0x60A9: Entry(U32, "rww", "", 1), 0x6502: Entry(U32, "ro", "0x001F0065")})
"""Does not watch its host, no action without it, no torque mode listed, unit of speed blank."""

YIYOU = COMPLETE.but(
    0x6007, 0x6076, 0x60A9, 0x60B2, lines=("speed_unit", "accepted.rpdo_deadline", "accepted.abort_connection")
).having(
    {
        0x6072: Entry(I16, "rw", "1000", 1),
        0x6087: Entry(I32, "rw", "0", 1),
        **pdos(0x1400, pdo("$NODEID+0x200", "0", "0x60400010", "0x60ff0020", "0x60600008")),
        **pdos(0x1800, pdo("$NODEID+0x40000180", "0", "0x60410010", "0x60770010"), pdo("$NODEID+0x280", "0")),
    }
)
"""Acyclic synchronous PDOs, signed max torque."""

E35 = COMPLETE.but(
    0x1016, 0x6007, 0x605A, lines=("speed_unit", "accepted.heartbeat_consumer", "accepted.rpdo_deadline")
).having(
    {
        0x100C: Entry(U16, default="", parameter="0x64"),
        0x100D: Entry(U8, default="", parameter="4"),
        0x608F: {0: Entry(U8, "const", "2"), 1: Entry(U32, default="0x7D0"), 2: Entry(U32, default="1")},
        0x60A9: Entry(U32, default="0xB50300"),
        0x60B2: Entry(I32, "rww", "0", 1),
    }
)
"""Speed in increments, offset of 32 bits, a ParameterValue left over in an EDS, node guarding."""

FIXED = COMPLETE.having(
    {
        0x1600: {
            0: Entry(U8, "const", "3"),
            1: Entry(U32, "const", "0x60400010"),
            2: Entry(U32, "const", "0x60710010"),
            3: Entry(U32, "const", "0x60B20010"),
        },
        **pdos(0x1800, pdo("$NODEID+0x180", "1", "0x60410010", "0x60770010", "0x606C0020")),
    }
)
"""A mapping that is right and can't be changed; the TPDO described as it is wanted."""


def fixed(*entries: str) -> Described:
    """Mapping parameter that can't be written."""
    return {0: Entry(U8, "const", str(len(entries)))} | {n: Entry(U32, "const", e) for n, e in enumerate(entries, 1)}


PREDEFINED = COMPLETE.but(0x1400, 0x1600, 0x60B2).having(
    {
        **pdos(0x1401, pdo("$NODEID+0x300", "255"), pdo("$NODEID+0x400", "255"), pdo("$NODEID+0x80000000", "255")),
        0x1601: fixed("0x60400010", "0x60600008"),
        0x1602: fixed("0x60400010", "0x60FF0020"),
        0x1603: fixed("0x60400010", "0x60710010"),
        **pdos(0x1800, *(pdo(f"$NODEID+0x{base:X}", "255") for base in (0x180, 0x280, 0x380, 0x80000480))),
        0x1A00: fixed("0x60410010"),
        0x1A01: fixed("0x60410010", "0x60610008"),
        0x1A02: fixed("0x60410010", "0x606C0020"),
        0x1A03: fixed("0x60410010", "0x60770010"),
    }
)
"""CiA 402's own PDOs, mapped for good: the feedback is in two, and the TPDO of the torque is off."""

APART = PREDEFINED.having(
    {
        **pdos(0x1403, pdo("$NODEID+0x500", "1"), pdo("0x80000000", "255")),
        0x1603: fixed("0x60400010", "0x60600008"),
        0x1604: fixed("0x60710010"),
        0x1A00: fixed("0x60410010", "0x60640020"),
        0x1A02: fixed("0x606C0020"),
        0x1A03: fixed("0x60770010"),
    }
)
"""Command in two RPDOs, one above the fourth without an identifier; feedback in three TPDOs."""


def for_good(cob_id: str, kind: str) -> Described:
    """Communication parameter whose identifier can't be written, commissioned for every SYNC."""
    return {0: Entry(U8, "ro", "2"), 1: Entry(U32, "ro", cob_id), 2: Entry(U8, default=kind, parameter="1")}


SIMPLIQ = COMPLETE.but(
    0x60A9,
    0x60B2,
    suffix=".dcf",
    header=COMPLETE.header + "[DeviceComissioning]\nBaudrate=125\nNetNumber=0\nLSS_SerialNumber=0\n\n",
    lines=("speed_unit", "accepted.rpdo_deadline"),
).having(
    {
        0x1005: Entry(U32, "ro", "0x80"),
        0x1017: Entry(U16, default="0x0", parameter="100"),
        0x6007: Entry(I16),
        0x6072: Entry(U16),
        0x608B: Entry(I8),
        0x608C: Entry(U8),
        0x1400: for_good("$NODEID+0x200", "0xff"),
        0x1401: for_good("$NODEID+0x300", "0xfe"),
        0x1800: for_good("$NODEID+0x40000180", "0xff"),
        0x1801: for_good("$NODEID+0x40000280", "0xfe"),
        0x1A01: {0: Entry(U8, parameter="1"), 1: Entry(U32, parameter="0x606c0020"), 2: Entry(U32), 3: Entry(U32)},
    }
)
"""Identifiers for good and mappings that can be set: the number of mapped objects, 0, switches a PDO off."""

SAMPLE = COMPLETE.but(
    0x1005,
    0x1014,
    0x1016,
    0x60A9,
    0x60B2,
    lines=("speed_unit", "option_codes.abort_connection", "accepted.heartbeat_consumer", "accepted.rpdo_deadline"),
).having(
    {
        0x1000: Entry(U32, "const", "0x00000000"),
        0x6007: Entry(I16, default="0x0000"),
        0x6072: Entry(U16, default="0x0000"),
        0x608B: Entry(I8, default="0x00"),
        0x608C: Entry(U8),
        0x6502: Entry(U32, "ro"),
        **pdos(0x1400, pdo("$NODEID+0x200", "0xFE", count="0x0"), pdo("$NODEID+0x300", "0xFE", count="0x0")),
        **pdos(0x1800, pdo("$NODEID+0x180", "0xFE", "0x0", count="0x0"), pdo("$NODEID+0x280", "0xFE", count="0x0")),
    }
)
"""A sample of CiA 402 with most values 0: max torque, abort connection option code, mappings."""

SHOUTING = COMPLETE.but(habit=lambda text: text.upper().replace("0X", "0x"))
"""All in capitals."""

MAKERS: dict[str, Maker] = {
    "complete": COMPLETE,
    "elmo": ELMO,
    "epos": EPOS,
    "epos, commissioned": EPOS_DCF,
    "nanotec": NANOTEC,
    "sevcon": SEVCON,
    "technosoft": TECHNOSOFT,
    "yiyou": YIYOU,
    "e35": E35,
    "fixed mapping": FIXED,
    "pre-defined PDOs": PREDEFINED,
    "each value apart": APART,
    "simpliq": SIMPLIQ,
    "sample": SAMPLE,
    "capitals": SHOUTING,
}
