"""An FMU: sources, binary and description in one archive."""

from __future__ import annotations

import hashlib
import math
import os
import re
import shutil
import tempfile
import zipfile
from collections.abc import Iterator
from datetime import UTC, datetime
from importlib import resources
from pathlib import Path
from typing import Final

from drivers.foreign_file import read_regular
from estimator.physics import inputs
from estimator.physics.curve import curve
from estimator.physics.effects.timing import FASTEST_S, lag_step, low_pass
from estimator.physics.kernel import conditions, rates, sensing, slots, state_vector
from estimator.physics.layout import SIZE, slot
from hil.child import run
from hil.config.model_file import read_model, read_model_for_recordings
from hil.errors import ModelFileError, UsageError
from hil.export.c_laws import Translation
from hil.export.fmu.description import IDENTIFIER, build_description, description
from hil.export.fmu.driveline import (
    NAMED,
    PARAMETER,
    STATE,
    STATES,
    VALUES,
    WARMTH,
    Driveline,
    begun,
    driveline,
    start_values,
    variables,
)
from hil.problems import read_toml
from hil.recording import read_record
from hil.recording.signals_config import SignalsConfig
from hil.result_folder import publish
from hil.version import install_hint

USED = (
    conditions.conditions, conditions.with_torque, conditions.is_elastic, conditions.is_extended,
    conditions.is_bristled, conditions.bent, conditions.rubbed, rates.stepped, rates.rates, rates.shaft_torques,
    sensing.entry, sensing.read_angle, sensing.smoothed, sensing.shown, low_pass, lag_step,
    inputs.follow,
)  # fmt: skip
"""What driveline.c calls; what these call comes along."""

_FROM_SLOTS = ("DELAY", "DELAYED_BEFORE", "LAG", "LAG_SHAPE", "FILTER", "FILTER_SHAPE")
_OF_THE_PATH = {
    "DEPTH": ("torque_derating", "depth"),
    "DERATING_TIME": ("torque_derating", "time_constant_s"),
    "HEATED": ("torque_derating", "heating_nm"),
    "WARM": ("torque_derating", "warm"),
}
_FROM_STATES = (
    "ANGLE", "SPEED", "TWIST", "LOAD_SPEED", "MIDDLE_TWIST", "MIDDLE_SPEED", "TRACTION", "LAGGED", "LAG_RISE",
    "FILTERED", "FILTER_RISE", "BRISTLES_MOTOR", "BRISTLES_LOAD",
)  # fmt: skip

_TYPES = {
    "2": {"INSTANCE": "fmi2Component", "REAL": "fmi2Real"},
    "3": {"INSTANCE": "fmi3Instance", "REAL": "fmi3Float64"},
}

PLATFORM = {"2.0": "linux64", "3.0": "x86_64-linux"}
"""Folder of the binary, as each version of the standard calls it."""

OPTIONS = ("-std=c99", "-O2", "-ffp-contract=off", "-fPIC", "-shared")
"""No product and sum in one instruction: the steps are those of hil to the last bits."""

COMPILER_S: Final = 300.0
"""Time for compiling an FMU's sources [s]."""


def laws() -> str:
    """Return laws.h."""
    unit = Translation()
    for function in USED:
        unit.function(function)
    head = "/* The laws of hil, translated from Python. The functions are named after their module. */\n"
    torque = _torque_laws(unit)  # before the text: it asks for functions
    return head + unit.text() + torque


def _torque_laws(unit: Translation) -> str:
    """Return the C function of the laws that entries declare for the torque, one behind the other.

    Those with a state are not among them: its course over a step is the co-simulation's own (driveline.c).
    """
    lines = ["static double laws_torque(double m1, double m2, double time_s, Array p) {"]
    for law in inputs.OF_INVERTERS:
        name, _ = unit.function(law.acting.law, of_one_number=True)
        lines += [
            f"    if ({_is_on(law)}) {m} = {name}({_called(law, m, str(i))});" for i, m in enumerate(("m1", "m2"))
        ]
    lines.append("    double torque = m1 + m2;")
    for law in inputs.OF_INVERTERS:
        if law.acting.of_sum is not None:
            name, _ = unit.function(law.acting.of_sum, of_one_number=True)
            lines.append(f"    if ({_is_on(law)}) torque = {name}({_called(law, 'torque')});")
    for law in inputs.OF_TORQUE:
        name, _ = unit.function(law.acting.law, of_one_number=True)
        lines.append(f"    if ({_is_on(law)}) torque = {name}({_called(law, 'torque', 'time_s')});")
    name, count = unit.function(curve)[0], slots.TABLE_TORQUE
    lines.append(f"    if (p.at[{count}] > 0.0) torque = torque + {name}(torque, p, {count}, 0).item0;")
    return "\n".join((*lines, "    return torque;", "}", ""))


def _is_on(law: inputs.TorqueLaw) -> str:
    return " || ".join(f"p.at[{at}] != {_number(float(null))}" for at, null in zip(law.sizes, law.nulls, strict=True))


def _called(law: inputs.TorqueLaw, *given: str) -> str:
    return ", ".join([*given, *(f"p.at[{at}]" for at in law.at)])


def model_header(d: Driveline, token: str) -> str:
    """Return model.h: structure, places and values of one model."""
    output = state_vector.LOAD_SPEED if d.sensor_at == "load" else state_vector.SPEED
    defined = {
        "MASSES": d.masses,
        "AROUND": int(d.is_around),
        "INERTIA": slot("", "J_M"),
        "OUTPUT": output,
        "STATES": STATES,
        "STATE": STATE,
        "PARAMETER": PARAMETER,
        "PARAMETERS": SIZE,
        "VALUES": VALUES,
        "WARMTH": WARMTH,
        "FASTEST_S": FASTEST_S,
        **{name: i for i, name in enumerate(NAMED)},
        **{name: getattr(state_vector, name) for name in _FROM_STATES},
        **{name: getattr(slots, name) for name in _FROM_SLOTS},
        **{name: slot(*key) for name, key in _OF_THE_PATH.items()},
        "GUID": f'"{token}"',
        "START_VALUES": ", ".join(_number(value) for value in start_values(d)),
    }
    lines = [f"#define {name} {value}" for name, value in defined.items()]
    return "\n".join(("#ifndef MODEL_H", "#define MODEL_H", "#include <math.h>", *lines, "#endif", ""))


def _number(value: float) -> str:
    return repr(value) if math.isfinite(value) else "INFINITY" if value > 0.0 else "-INFINITY"


def own(name: str) -> str:
    """Return one of the C files that are the same for every model."""
    return (resources.files("hil.export.fmu") / "c" / name).read_text("ascii")


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


def c_files(d: Driveline, version: str) -> tuple[dict[str, str], list[str], str]:
    """Return the C files by name, those of them that are compiled, and the token of this build."""
    number = version[0]
    headers = {name: text for name, text in _headers().items() if name.startswith(f"fmi{number}")}
    functions = f"fmi{number}Functions.h"
    files_of_hil = {name: own(name) for name in ("driveline.c", "driveline.h")}
    files_of_hil[f"fmi{number}.c"] = interface(number)
    missing = stubs(headers[f"fmi{number}FunctionTypes.h"], functions, files_of_hil[f"fmi{number}.c"])
    files = {**headers, **files_of_hil, "laws.h": laws(), "stubs.c": missing}
    text = "".join((*files.values(), model_header(d, "")))
    token = f"{{{hashlib.sha256(text.encode()).hexdigest()[:32]}}}"
    files["model.h"] = model_header(d, token)
    return files, ["driveline.c", f"fmi{number}.c", "stubs.c"], token


def write(d: Driveline, version: str, path: Path, sources_only: bool = False) -> None:
    """Write an FMU."""
    files, compiled, token = c_files(d, version)
    described = description(version, d.name, token, datetime.now(UTC), d.period_s, compiled, variables(d))
    content: dict[str, bytes | str] = {
        "modelDescription.xml": described,
        **{f"sources/{name}": text for name, text in files.items()},
    }
    if version == "3.0":
        content["sources/buildDescription.xml"] = build_description(compiled)
    if not sources_only:
        content[f"binaries/{PLATFORM[version]}/{IDENTIFIER}.so"] = _binary(files, compiled)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, text in content.items():
            archive.writestr(name, text)


def _headers() -> dict[str, str]:
    try:
        import fmpy
    except ModuleNotFoundError as error:
        raise UsageError(
            "hil export fmu: expected FMPy, which brings the headers of the FMI standard, got none. Install it: "
            + install_hint("fmu")
        ) from error
    folder = Path(fmpy.__file__).parent / "c-code"
    return {path.name: path.read_text("utf-8") for path in sorted(folder.glob("fmi*.h"))}


def _compiler() -> str:
    named = os.environ.get("CC")
    found = next((path for name in ((named,) if named else ("cc", "gcc", "clang")) if (path := shutil.which(name))), "")
    if not found:
        raise UsageError(
            f"expected a C compiler to make the FMU's binary ({named or 'cc, gcc or clang'}), got none. Install one, "
            "name it in the variable CC, or write the FMU without a binary: --sources-only"
        )
    return found


def _binary(files: dict[str, str], compiled: list[str]) -> bytes:
    compiler = _compiler()
    with tempfile.TemporaryDirectory() as folder:
        for name, text in files.items():
            (Path(folder) / name).write_text(text, "utf-8")
        command = [compiler, *OPTIONS, *compiled, "-o", "out.so", "-lm"]
        done = run(command, Path(folder), COMPILER_S)
        if done.status != 0:
            said = done.said.strip()[:500] or f"one that is not done in {COMPILER_S:g} s"
            raise UsageError(f"{compiler}: expected a compiler that takes C99, got: {said}")
        return read_regular(Path(folder) / "out.so")


def written_fmu(
    model: Path, out: Path, version: str, period_s: float, recording: Path | None, sources_only: bool, dbc: Path | None
) -> Iterator[str]:
    """Write an FMU and yield the lines that say so."""
    if out.suffix.lower() != ".fmu":
        raise UsageError(f"--out {out}: expected a name that ends in .fmu, got {out.suffix!r}")
    if read_toml(model, ModelFileError).get("laws"):
        raise UsageError(
            f"{model}: laws | expected effects of the catalogue, whose laws hil can write as C, got a law of your own "
            "in Python. Take it out, and write it in your simulation."
        )
    file = read_model(model) if recording is None else read_model_for_recordings(model)
    sensor_at = (file.signals or SignalsConfig()).output()[1].at
    line = driveline(out.stem, file.model, period_s, sensor_at)
    if recording is not None:
        line, _ = begun(line, file.model, read_record(recording, file.signals, file.on_bench, dbc))
    publish(out.parent, {out.name: lambda path: write(line, version, path, sources_only)})
    what = "C sources" if sources_only else "C sources and a Linux binary"
    start = "at rest" if recording is None else f"as in {recording.name}"
    yield f"{out}: FMI {version}, co-simulation, {what}; starts {start}"
    yield from (f"note: {text}" for text in line.left_out)
