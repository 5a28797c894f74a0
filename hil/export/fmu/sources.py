"""The C files of the exported driveline: the laws, what the model is, and what a standard asks for and it has not."""

from __future__ import annotations

import math
import re
from importlib import resources

from estimator.physics import low_pass, start, torque_path
from estimator.physics.effects import actuator_lag
from estimator.physics.kernel import bristles, conditions, contact, line, rates, sensing, slots, state_vector
from estimator.physics.layout import SIZE, slot
from hil.export.c.translation import Translation
from hil.export.fmu import variables as places
from hil.export.fmu.driveline import Driveline

USED = (
    conditions.conditions, conditions.with_torque, line.is_elastic, line.is_extended, line.is_bristled, bristles.bent,
    bristles.rubbed, contact.stepped, rates.rates, rates.shaft_torques, sensing.entry, sensing.reading,
    sensing.read_angle, sensing.smoothed, sensing.shown, low_pass.low_pass, actuator_lag.step, start.follow,
)  # fmt: skip
"""What driveline.c calls; what these call comes along."""

_FROM_SLOTS = ("DELAY", "DELAYED_BEFORE", "LAG", "LAG_SHAPE", "FILTER", "FILTER_SHAPE")
_OF_THE_PATH = {
    "GAIN_M1": ("inverter_gain_mismatch", "gain_m1"),
    "GAIN_M2": ("inverter_gain_mismatch", "gain_m2"),
    "LIMIT_M1": ("torque_saturation", "limit_m1_nm"),
    "LIMIT_M2": ("torque_saturation", "limit_m2_nm"),
    "LIMIT_SHARPNESS": ("torque_saturation", "sharpness"),
    "LIMIT_SUM": ("torque_saturation", "limit_sum_nm"),
    "DEPTH": ("torque_derating", "depth"),
    "DERATING_TIME": ("torque_derating", "time_constant_s"),
    "HEATED": ("torque_derating", "heating_nm"),
}
_FROM_STATES = (
    "ANGLE", "SPEED", "TWIST", "LOAD_SPEED", "MIDDLE_TWIST", "MIDDLE_SPEED", "TRACTION", "LAGGED", "LAG_RISE",
    "FILTERED", "FILTER_RISE", "BRISTLES_MOTOR", "BRISTLES_LOAD",
)  # fmt: skip


def laws() -> str:
    """Return laws.h."""
    unit = Translation()
    for function in USED:
        unit.function(function)
    unit.function(torque_path.limited, of_one_number=True)
    head = "/* The laws of hil, translated from Python. The functions are named after their module. */\n"
    torque = _torque_laws(unit)  # before the text: it asks for functions
    return head + unit.text() + torque


def _torque_laws(unit: Translation) -> str:
    """Return the C function of the laws that entries declare for the torque, one behind the other."""
    lines = ["static double laws_torque(double torque, double time_s, Array p) {"]
    for law, at, null in torque_path.DECLARED:
        name, _ = unit.function(law, of_one_number=True)
        values = ", ".join(["torque", "time_s", *(f"p.at[{place}]" for place in at)])
        lines.append(f"    if (p.at[{at[0]}] != {_number(null)}) torque = {name}({values});")
    return "\n".join((*lines, "    return torque;", "}", ""))


def model_header(d: Driveline, token: str) -> str:
    """Return model.h: structure, places and values of one model."""
    output = state_vector.LOAD_SPEED if d.sensor_at == "load" else state_vector.SPEED
    continuous = places.continuous(d)
    defined = {
        "MASSES": d.masses,
        "OUTPUT": output,
        "STATES": places.STATES,
        "STATE": places.STATE,
        "DERIVATIVE": places.DERIVATIVE,
        "PARAMETER": places.PARAMETER,
        "PARAMETERS": SIZE,
        "VALUES": places.VALUES,
        "WARMTH": places.WARMTH,
        "FASTEST_S": actuator_lag.FASTEST_S,
        "CONTINUOUS_COUNT": len(continuous),
        "CONTINUOUS_STATES": ", ".join(map(str, continuous)),
        **{name: i for i, name in enumerate(places.NAMED)},
        **{name: getattr(state_vector, name) for name in _FROM_STATES},
        **{name: getattr(slots, name) for name in _FROM_SLOTS},
        **{name: slot(*key) for name, key in _OF_THE_PATH.items()},
        "GUID": f'"{token}"',
        "START_VALUES": ", ".join(_number(value) for value in places.start_values(d)),
    }
    lines = [f"#define {name} {value}" for name, value in defined.items()]
    return "\n".join(("#ifndef MODEL_H", "#define MODEL_H", "#include <math.h>", *lines, "#endif", ""))


def _number(value: float) -> str:
    return repr(value) if math.isfinite(value) else "INFINITY" if value > 0.0 else "-INFINITY"


def own(name: str) -> str:
    """Return one of the C files that are the same for every model."""
    return (resources.files("hil.export.fmu") / "c" / name).read_text("ascii")


_TYPES = {
    "2": {"INSTANCE": "fmi2Component", "REAL": "fmi2Real"},
    "3": {"INSTANCE": "fmi3Instance", "REAL": "fmi3Float64"},
}


def interface(number: str) -> str:
    """Return the C file with the functions of a version of the standard: what both have, and what it has alone."""
    text = own("fmi.c").replace("fmiX", f"fmi{number}")
    for name, of in _TYPES[number].items():
        text = text.replace(f"TYPE_OF_{name}", of)
    return text + own(f"fmi{number}.c")


def stubs(types: str, functions: str, written: str) -> str:
    """Return a C file with the functions of a standard that a model does not have: they answer with an error."""
    out = [f'#include "{functions}"', ""]
    bare = re.sub(r"/\*.*?\*/", "", types, flags=re.DOTALL)
    for returned, name, given in re.findall(r"typedef\s+([\w\s*]+?)\s*\b(\w+)TYPE\s*\(([^;]*)\);", bare):
        if re.search(rf"\b{name}\(", written):
            continue
        error = "" if returned == "void" else f"return {'NULL' if 'Status' not in returned else name[:4] + 'Error'};"
        named = re.sub(r"(fmi2Byte)\[\]", r"\1 bytes[]", " ".join(given.split()))
        out.append(f"{returned} {name}({named}) {{ {error} }}")
    return "\n".join((*out, ""))
