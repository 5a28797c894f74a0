"""What a diagnosis says of an FMU, in the FMU's own terms."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from estimator.diagnosis.result import Diagnosis, Verdict
from estimator.physics.effect import Element
from estimator.physics.model import parameter_unit
from estimator.signals.record import Location
from hil.plants.fmu_line import FmuLine
from hil.plants.fmu_tune import in_names_of_fmu
from hil.report.numbers import listed, shown


def in_its_terms(diagnosis: Diagnosis, line: FmuLine, at: Location) -> Diagnosis:
    """Return a diagnosis with parameters by an FMU's names, and what would have to be added to the FMU.

    ``at`` is where its output is.
    """
    said = [diagnosis.statement, _how(diagnosis.fit.unit, line), *_added(diagnosis, line, at)]
    parameters = in_names_of_fmu(diagnosis.parameters, line.tuned)
    return replace(diagnosis, statement=" ".join(said), parameters=parameters)


def _how(unit: str, line: FmuLine) -> str:
    name, count = line.fmu.name, f"It was simulated {line.fmu.simulations} times."
    error = f"{shown(line.error, unit)} at a noise of {shown(line.noise, unit)}"
    if not line.is_alike:
        return (
            f"No line of one or two inertias answers as {name} does: the nearest is off by {error}. So only effects at "
            f"its inputs, its shafts and its output were tried; what is inside was taken as it is. {count}"
        )
    motion = line.model.motion
    values = [
        f"{key} = {shown(each.value, parameter_unit(key, motion))}" for key, each in line.model.parameters.items()
    ]
    return f"{name} answers as a line with {listed(values)}, off by {error}; effects were sought on that line. {count}"


def _added(diagnosis: Diagnosis, line: FmuLine, at: Location) -> Iterator[str]:
    name = line.fmu.name
    places: dict[str, list[str]] = {}
    for effect in diagnosis.effects:
        places.setdefault(_place(Element(effect.element), line, at), []).append(effect.name)
    if places:
        yield f"To {name} would have to be added: {'; '.join(f'{at} {listed(each)}' for at, each in places.items())}."
    known = {each: line.tuned[each] for each in diagnosis.parameters if each in line.tuned}
    changed = [
        f"{each.name} = {shown(each.found_as(diagnosis.parameters[k]).value, each.unit)}" for k, each in known.items()
    ]
    if changed and diagnosis.verdict is not Verdict.UNEXPLAINED:
        yield f"Its parameters would be {listed(changed)}."


def _place(element: Element, line: FmuLine, at: Location) -> str:
    """Return where in an FMU an effect belongs."""
    named, stiffness = line.named, line.model.values().get("k")
    inputs = listed(list(named.torque))
    which = "" if stiffness is None else f" of {shown(stiffness, parameter_unit('k', line.model.motion))}"
    return {
        Element.TORQUE_PATH: f"before {inputs}",
        Element.MOTOR: f"to {inputs}, a torque from {named.output if at is Location.MOTOR else 'the speed there'}:",
        Element.SHAFT: f"in its shaft{which}",
        Element.LOAD: f"to {named.load or 'the load, which has no input'}, a torque from the load's motion:",
        Element.SPEED_SENSOR: f"behind {named.output}",
        Element.ACQUISITION: "not in it but in what records:",
    }[element]
