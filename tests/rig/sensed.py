"""A rig file with further channels: two objects of a drive's second and third TPDO, and a register of the PLC."""

import re
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from drivers.resources import data_file
from hil.config.rig_file import Rig, read_rig
from hil.simulator.addresses import with_addresses
from hil.simulator.driveline import plant_for
from hil.simulator.faults import RigFaults
from hil.simulator.rig_server import RigServer
from tests.rig.serving import ANY_PORT, CHANGES, EXAMPLE, changed

CHANNELS = """
[[channels]]
column = "speed_load_rad_s"
kind = "speed"
at = "load"
inverter = "m2"
object = 0x60E5
subindex = 1
scale = 0.001

[[channels]]
column = "accel_rad_s2"
kind = "acceleration"
at = "motor"
register = "acceleration"

[[channels]]
column = "torque_shaft_nm"
kind = "torque"
at = "shaft"
inverter = "m2"
object = 0x2100
scale = 0.1
"""

OBJECTS = """
[60E5]
ParameterName=Additional velocity actual value
ObjectType=0x8
SubNumber=2

[60E5sub0]
ParameterName=Highest sub-index supported
ObjectType=0x7
DataType=0x0005
AccessType=const
DefaultValue=1
PDOMapping=0

[60E5sub1]
ParameterName=1st additional velocity actual value
ObjectType=0x7
DataType=0x0004
AccessType=ro
PDOMapping=1

[2100]
ParameterName=Torque at the flange
ObjectType=0x7
DataType=0x0003
AccessType=ro
PDOMapping=1
"""

REGISTER = """
[registers.acceleration]
kind = "input_register"
address = 100
type = "int16"
scale = 0.01
unit = "rad/s^2"
access = "read"
description = "Acceleration of the motor."
"""


def eds_with_sensors(tpdos: int = 2) -> str:
    """The shipped EDS with the two objects, and so many TPDOs of which only the first maps anything."""
    text = data_file("inverter.eds").read_text()
    sections = re.findall(r"(?ms)^\[(?:1800|1A00)(?:sub\w+)?\]\n.*?(?=^\[)", text)
    further, listed = OBJECTS, [0x60E5]
    for number in range(1, tpdos):
        for section in sections:
            copy = section.replace("[1800", f"[180{number}").replace("[1A00", f"[1A0{number}")
            copy = copy.replace("0x180", f"0x{0x180 + 0x100 * number:X}").replace("DefaultValue=3", "DefaultValue=0")
            further += copy
        listed += [0x1800 + number, 0x1A00 + number]
    text = text.replace("SupportedObjects=35", f"SupportedObjects={35 + len(listed)}")
    lines = "".join(f"{36 + n}=0x{index:04X}\n" for n, index in enumerate(listed))
    text = text.replace("35=0x6502\n", f"35=0x6502\n{lines}")
    text = text.replace(
        "[ManufacturerObjects]\nSupportedObjects=0", "[ManufacturerObjects]\nSupportedObjects=1\n1=0x2100"
    )
    return text + further


def write_rig(folder: Path, channels: str = CHANNELS, tpdos: int = 2) -> Path:
    """Write rig file, EDS of m2 and register map into a folder."""
    (folder / "m2.eds").write_text(eds_with_sensors(tpdos))
    (folder / "map.toml").write_text(data_file("plc.toml").read_text() + REGISTER)
    text = EXAMPLE.read_text("utf-8").replace("port = 5020\n", 'port = 5020\nmap = "map.toml"\n')
    text = text.replace("node_id = 2\n", 'node_id = 2\neds = "m2.eds"\n')
    path = folder / "rig.toml"
    path.write_text(text + channels, "utf-8")
    return path


def sensed_rig(folder: Path, channels: str = CHANNELS) -> Rig:
    """The rig of that file, with short experiments and little noise."""
    changes = {name: values for name, values in CHANGES.items() if name != "vehicle"}
    rig: Rig = changed(read_rig(write_rig(folder, channels)), changes)
    return rig


@contextmanager
def served_with_sensors(rig: Rig, faults: RigFaults | None = None) -> Iterator[Rig]:
    """Serve the driveline of a rig file; yields the rig at the server's addresses."""
    with RigServer(plant_for(rig), rig, f"virtual:{uuid.uuid4()}", ANY_PORT, faults) as server:
        yield with_addresses(rig, server.bus_url, str(server.modbus))
