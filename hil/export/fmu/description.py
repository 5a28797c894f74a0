"""modelDescription.xml of FMI 2.0 and of FMI 3.0."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from hil.export.fmu.driveline import Variable
from hil.version import __version__

IDENTIFIER = "driveline"
"""Name of the binary and prefix of nothing else: the functions are exported by their own names."""


def description(
    version: str, name: str, token: str, made: datetime, period_s: float, sources: Sequence[str],
    variables: Sequence[Variable],
) -> bytes:  # fmt: skip
    """Return the text of modelDescription.xml."""
    is_2 = version == "2.0"
    root = Element(
        "fmiModelDescription",
        {
            "fmiVersion": version,
            "modelName": name,
            "guid" if is_2 else "instantiationToken": token,
            "generationTool": f"hil {__version__}",
            "generationDateAndTime": made.strftime("%Y-%m-%dT%H:%M:%SZ"),
            "variableNamingConvention": "structured",
        },
    )
    attributes = {"modelIdentifier": IDENTIFIER, "canHandleVariableCommunicationStepSize": "true"}
    of_kind = SubElement(root, "CoSimulation", attributes)
    if is_2:
        files = SubElement(of_kind, "SourceFiles")
        for source in sources:
            SubElement(files, "File", {"name": source})
    units = SubElement(root, "UnitDefinitions")
    for unit in sorted({each.unit for each in variables if each.unit}):
        SubElement(units, "Unit", {"name": unit})
    SubElement(root, "DefaultExperiment", {"startTime": "0", "stepSize": repr(period_s)})
    listed = SubElement(root, "ModelVariables")
    for each in variables:
        (_variable_2 if is_2 else _variable_3)(listed, each)
    (_structure_2 if is_2 else _structure_3)(SubElement(root, "ModelStructure"), variables)
    indent(root)
    return bytes(tostring(root, encoding="utf-8", xml_declaration=True))


def build_description(sources: Sequence[str]) -> bytes:
    """Return sources/buildDescription.xml of FMI 3.0."""
    root = Element("fmiBuildDescription", {"fmiVersion": "3.0"})
    build = SubElement(root, "BuildConfiguration", {"modelIdentifier": IDENTIFIER})
    files = SubElement(build, "SourceFileSet", {"language": "C99"})
    for source in sources:
        SubElement(files, "SourceFile", {"name": source})
    indent(root)
    return bytes(tostring(root, encoding="utf-8", xml_declaration=True))


def _common(each: Variable) -> dict[str, str]:
    attributes = {"name": each.name, "valueReference": str(each.reference), "causality": each.causality}
    attributes["variability"] = each.variability
    if each.description:
        attributes["description"] = each.description
    return attributes


def _value(start: float | bool) -> str:
    return str(start).lower() if isinstance(start, bool) else repr(float(start))


def _typed(each: Variable) -> dict[str, str]:
    """Return the attributes that depend on the type: unit and start."""
    attributes = {"unit": each.unit} if each.unit else {}
    if each.start is not None:
        attributes["start"] = _value(each.start)
    return attributes


def _variable_2(listed: Element, each: Variable) -> None:
    variable = SubElement(listed, "ScalarVariable", _common(each))
    SubElement(variable, "Boolean" if isinstance(each.start, bool) else "Real", _typed(each))


def _variable_3(listed: Element, each: Variable) -> None:
    tag = "Boolean" if isinstance(each.start, bool) else "Float64"
    SubElement(listed, tag, {**_common(each), **_typed(each)})


def _structure_2(structure: Element, variables: Sequence[Variable]) -> None:
    """List the outputs by their places in the list, counted from 1: FMI 2.0 refers to that."""
    places = [place for place, each in enumerate(variables, 1) if each.causality == "output"]
    for tag in ("Outputs", "InitialUnknowns"):
        group = SubElement(structure, tag)
        for place in places:
            SubElement(group, "Unknown", {"index": str(place)})


def _structure_3(structure: Element, variables: Sequence[Variable]) -> None:
    for tag in ("Output", "InitialUnknown"):
        for each in variables:
            if each.causality == "output":
                SubElement(structure, tag, {"valueReference": str(each.reference)})
