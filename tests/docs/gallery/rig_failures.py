"""Failures on the rig: a simulated device, the bus or the PLC goes wrong during a run, or is wrong before it."""

import re
from functools import partial
from pathlib import Path

from hil.config.rig_file import read_rig
from hil.simulator.addresses import Address
from hil.simulator.driveline import plant_for
from hil.simulator.fault_table import rig_faults
from hil.simulator.rig_server import RigServer
from tests.docs.gallery.case import Failure, Outcome, said
from tests.docs.gallery.draw import signals_of

EXAMPLE = Path(__file__).resolve().parents[3] / "examples" / "rig.toml"
AT_S = 2.5
"""When a fault comes, in simulated time: the cruise is being recorded by then."""

BUS_PORT, PLC_PORT = 54791, 5091
"""Not those of the example: its rig may be served here, too."""

BRIDGED = r"Virtual bus channel \S+ on "
"""The server's own name of its bus, another one each time."""

ALWAYS_PRINTED = re.compile(r"^registers of plc\n.*?┘\n|^m\d: if the host fails(?:.|\n(?!\w+: |error))*\n", re.M | re.S)
"""What `hil check` prints of a healthy rig as well."""

SHORTER = (
    ("127.0.0.1:54701", f"127.0.0.1:{BUS_PORT}"),
    ("port = 5020", f"port = {PLC_PORT}"),
    ("speed_rad_s = 60.0", "speed_rad_s = 0.0"),
    ('kind = "cruise"\nduration_s = 30.0', 'kind = "cruise"\nduration_s = 3.0'),
)


def write_rig(changes: tuple[tuple[str, str], ...] = SHORTER) -> Path:
    """Write the example's rig file, changed, as ``rig.toml`` here."""
    text = EXAMPLE.read_text(encoding="utf-8")
    for before, after in changes:
        if text.count(before) != 1:
            raise LookupError(f"{EXAMPLE} holds {before!r} {text.count(before)} times, expected once")
        text = text.replace(before, after)
    path = Path("rig.toml")
    path.write_text(text, encoding="utf-8")
    return path


def on_rig(command: str, fault: str, draws: bool = False) -> Outcome:
    """Carry out a command on the simulated rig of ``rig.toml`` with a fault."""
    rig = read_rig(write_rig())
    faults = rig_faults([fault], rig.period_s)
    with RigServer(plant_for(rig, []), rig, rig.can.url, Address(rig.plc.host, rig.plc.port), faults):
        pace = ("--pace", "fast") if command.startswith("hil run") else ()
        text, status = said(command, *pace, without=BRIDGED)
    text = re.sub(r"(?:^\.\.\.\n)+", "...\n", ALWAYS_PRINTED.sub("...\n", text), flags=re.M)
    return Outcome(
        f"hil sim rig.toml --fault {fault}\n{command}", text, status, signals_of(Path("cruise.csv")) if draws else None
    )


_run = partial(on_rig, "hil run rig.toml cruise --out cruise.csv")
_check = partial(on_rig, "hil check rig.toml")

RIG = (
    Failure("stale_pdo", partial(_run, f"m1.stale_pdo@{AT_S}", draws=True)),
    Failure("lost_frames", partial(_run, "bus.lose=0.05:0x181", draws=True)),
    Failure("bus_off", partial(_run, f"bus.off@{AT_S}")),
    Failure("drive_fault", partial(_run, f"m1.fault@{AT_S}", draws=True)),
    Failure("target_ignored", partial(_run, f"m2.ignores_target@{AT_S}", draws=True)),
    Failure("word_order", partial(_check, "plc.swapped_floats")),
    Failure("wrong_unit", partial(_check, "plc.wrong_unit@0")),
    Failure("permissive_lost", partial(_run, f"plc.permissive_withdrawn@{AT_S}")),
    Failure("clutch_closes", partial(_run, f"plc.clutch_closes@{AT_S}")),
    Failure("mode_refused", partial(_run, "m2.refuse_mode")),
    Failure("missing_object", partial(_run, "m1.lacks=0x60B2")),
    Failure("wrong_drive", partial(_check, "m2.wrong_identity")),
    Failure("drive_absent", partial(_check, "m2.absent")),
)
