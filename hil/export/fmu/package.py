"""An FMU: sources, binary and description in one archive."""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import tempfile
import zipfile
from datetime import UTC, datetime
from pathlib import Path

from hil.errors import UsageError
from hil.export.fmu import sources
from hil.export.fmu.description import IDENTIFIER, build_description, description
from hil.export.fmu.driveline import Driveline
from hil.export.fmu.variables import variables

PLATFORM = {"2.0": "linux64", "3.0": "x86_64-linux"}
"""Folder of the binary, as each version of the standard calls it."""

OPTIONS = ("-std=c99", "-O2", "-ffp-contract=off", "-fPIC", "-shared")
"""No product and sum in one instruction: the steps are those of hil to the last bits."""


def c_files(d: Driveline, version: str) -> tuple[dict[str, str], list[str], str]:
    """Return the C files by name, those of them that are compiled, and the token of this build."""
    number = version[0]
    headers = {name: text for name, text in _headers().items() if name.startswith(f"fmi{number}")}
    functions = f"fmi{number}Functions.h"
    own = {name: sources.own(name) for name in ("driveline.c", "driveline.h")}
    own[f"fmi{number}.c"] = sources.interface(number)
    stubs = sources.stubs(headers[f"fmi{number}FunctionTypes.h"], functions, own[f"fmi{number}.c"])
    files = {**headers, **own, "laws.h": sources.laws(), "stubs.c": stubs}
    text = "".join((*files.values(), sources.model_header(d, "")))
    token = f"{{{hashlib.sha256(text.encode()).hexdigest()[:32]}}}"
    files["model.h"] = sources.model_header(d, token)
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
            "pip install 'hil-driveline[fmu]'"
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
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        if done.returncode:
            raise UsageError(f"{compiler}: expected a compiler that takes C99, got: {done.stderr.strip()[:500]}")
        return (Path(folder) / "out.so").read_bytes()
