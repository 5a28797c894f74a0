"""What was found around an FMU, as an SSP: the FMU as it is, and one of ours at each shaft, connected.

System Structure and Parameterization 1.0 (Modelica Association): any tool that reads it simulates both together. The
coupling is explicit, as importers do it: what one puts out acts in the other a step later.
"""

from __future__ import annotations

import tempfile
import zipfile
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from xml.etree.ElementTree import Element as XmlElement, SubElement, indent, tostring

from estimator.diagnosis.flange import AT_LOAD, AT_MOTOR, FREE, slots_of, with_only
from estimator.diagnosis.result import Diagnosis
from estimator.physics.catalogue import EFFECTS
from estimator.physics.effect import Element
from estimator.physics.layout import flat, slot
from estimator.physics.model import Structure
from estimator.signals.record import Location, OutputKind, Record
from hil.export.fmu import package
from hil.export.fmu.driveline import OF_THE_RECORDER, Driveline, driveline
from hil.plants.fmu_line import FmuLine
from hil.version import __version__

STANDARD = "http://ssp-standard.org/SSP1/SystemStructure"
PLANT = "plant"
OUTSIDE = ""
"""Stands for the system itself where something is connected."""

Connection = tuple[str, str, str, str]
"""Element and connector where it starts, and where it ends."""


def augmented_ssp(diagnosis: Diagnosis, line: FmuLine, fmu: Path, record: Record) -> Callable[[Path], None] | None:
    """Return what writes an FMU with the effects found around it; None where there are none, or one is inside.

    The diagnosis names parameters as the FMU does.
    """
    named, inertias, effects = line.named, line.model.values(), diagnosis.augmented.effects
    is_rigid = line.model.structure is Structure.ONE_MASS
    behind = [] if is_rigid else [name for name in effects if name in AT_LOAD]
    before = [name for name in effects if name not in behind]
    outside = (Element.TORQUE_PATH, Element.SPEED_SENSOR, Element.ACQUISITION)
    known = (*AT_MOTOR, *(AT_LOAD if is_rigid else ()), *(n for n, each in EFFECTS.items() if each.element in outside))
    at_load = bool(named.load_speed) and line.fmu.is_input(named.load)
    is_at_motor = bool(effects) and record.location is Location.MOTOR and record.kind is OutputKind.SPEED
    if not is_at_motor or not line.fmu.takes_laws(named) or not {*before} <= {*known} or (behind and not at_load):
        return None

    def around(name: str, at: Collection[str], inertia: float) -> Driveline:
        kept = [each for each in at if each not in OF_THE_RECORDER]
        p = with_only(flat(diagnosis.augmented), slots_of(kept))
        p[slot("", "J_M")] = inertia
        return replace(driveline(name, FREE, record.sample_time_s), p=p, effects=tuple(kept), is_around=True)

    ours = {"motor": around("motor", before, inertias["J_M"])}
    connections: list[Connection] = [
        (OUTSIDE, "T_M1", "motor", "T_M1"),
        (OUTSIDE, "T_M2", "motor", "T_M2"),
        ("motor", "torque_passed", PLANT, named.torque[0]),
        (PLANT, named.output, "motor", "speed_seen"),
        ("motor", "speed_measured", OUTSIDE, "speed_measured"),
    ]
    if behind:
        ours["load"] = around("load", behind, inertias["J_L"])
        connections += [
            (OUTSIDE, "T_load", "load", "T_load"),
            ("load", "load_passed", PLANT, named.load),
            (PLANT, named.load_speed, "load", "speed_seen"),
        ]
    elif line.fmu.is_input(named.load):
        connections.append((OUTSIDE, "T_load", PLANT, named.load))
    values = dict.fromkeys(named.torque[1:], 0.0)  # their sum acts at the first
    tuned = {each.name for each in line.tuned.values()}
    values |= {name: each.value for name, each in diagnosis.parameters.items() if name in tuned}
    described = structure(fmu.stem, (PLANT, *ours), connections, values)
    files: dict[str, bytes] = {"SystemStructure.ssd": described}
    with tempfile.TemporaryDirectory() as folder:
        for name, each in ours.items():
            package.write(each, "2.0", path := Path(folder) / f"{name}.fmu")
            files[f"resources/{name}.fmu"] = path.read_bytes()

    def write(path: Path) -> None:
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.write(fmu, f"resources/{PLANT}.fmu")
            for name, content in files.items():
                archive.writestr(name, content)

    return write


def structure(
    name: str, components: Sequence[str], connections: Collection[Connection], values: Mapping[str, float]
) -> bytes:
    """Return SystemStructure.ssd of some FMUs; ``values`` are parameters of the user's."""
    spaces = {"ssd": "Description", "ssc": "Common", "ssv": "ParameterValues"}
    of_file = {f"xmlns:{short}": STANDARD + each for short, each in spaces.items()}
    root = XmlElement("ssd:SystemStructureDescription", {**of_file, "name": name, "version": "1.0"})
    root.set("generationTool", f"hil {__version__}")
    system = SubElement(root, "ssd:System", {"name": "augmented"})
    _connectors(system, OUTSIDE, connections)
    elements = SubElement(system, "ssd:Elements")
    for each in components:
        attributes = {"type": "application/x-fmu-sharedlibrary", "source": f"resources/{each}.fmu"}
        component = SubElement(elements, "ssd:Component", {"name": each, **attributes})
        _connectors(component, each, connections)
        if each == PLANT and values:
            binding = SubElement(SubElement(component, "ssd:ParameterBindings"), "ssd:ParameterBinding")
            given = SubElement(binding, "ssd:ParameterValues")
            parameters = SubElement(given, "ssv:ParameterSet", {"version": "1.0", "name": "found"})
            listed = SubElement(parameters, "ssv:Parameters")
            for parameter, value in values.items():
                SubElement(SubElement(listed, "ssv:Parameter", {"name": parameter}), "ssv:Real", {"value": repr(value)})
    listed = SubElement(system, "ssd:Connections")
    for one, start, other, end in connections:
        ends = {"startElement": one, "startConnector": start, "endElement": other, "endConnector": end}
        SubElement(listed, "ssd:Connection", {key: each for key, each in ends.items() if each})
    indent(root)
    return bytes(tostring(root, encoding="utf-8", xml_declaration=True))


def _connectors(into: XmlElement, of: str, connections: Collection[Connection]) -> None:
    """List what of an element is connected; what comes into the system leaves its own connector."""
    leaves, enters = ("input", "output") if of == OUTSIDE else ("output", "input")
    kinds = {start: leaves for one, start, _, _ in connections if one == of}
    kinds |= {end: enters for _, _, other, end in connections if other == of}
    listed = SubElement(into, "ssd:Connectors")
    for name, kind in kinds.items():
        SubElement(SubElement(listed, "ssd:Connector", {"name": name, "kind": kind}), "ssc:Real")
