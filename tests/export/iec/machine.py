"""A PLC of one function block or program: the text translated to C, compiled by gcc, called from here."""

import ctypes
import hashlib
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

from tests.export.iec.parser import Parser
from tests.export.iec.to_c import to_c
from tests.export.iec.tree import Block

NUMBERS: dict[str, Any] = {
    "BOOL": ctypes.c_int8,
    "INT": ctypes.c_int16,
    "DINT": ctypes.c_int32,
    "LREAL": ctypes.c_double,
    "REAL": ctypes.c_float,
}

FLAGS = ("-std=c11", "-O2", "-ffp-contract=off", "-Wall", "-Werror", "-Wno-parentheses-equality", "-shared", "-fPIC")
"""No contraction of products and sums: each operation is rounded by itself, as IEC 61131-3 (IEC 60559) has it."""


class Machine:
    """One instance of a function block or program; inputs are set and outputs read by name."""

    def __init__(self, text: str, block: str, folder: Path) -> None:
        blocks = Parser(text).blocks()
        library = _compiled(to_c(blocks), folder)
        structures = _structures(blocks)
        self._memory = structures[block]()
        getattr(library, f"{block}_start")(ctypes.byref(self._memory))
        self._call = getattr(library, f"{block}_call")

    def __call__(self, **inputs: float | bool) -> Any:
        """Set inputs and carry out one cycle; the instance's variables can be read from what is returned."""
        for name, value in inputs.items():
            setattr(self._memory, name, value)
        self._call(ctypes.byref(self._memory))
        return self._memory


def _structures(blocks: dict[str, Block]) -> dict[str, Any]:
    made: dict[str, Any] = {}
    for block in blocks.values():
        fields = []
        for variable in block.variables.values():
            kind = NUMBERS.get(variable.shape.element) or made[variable.shape.element]
            for low, high in reversed(variable.shape.bounds):
                kind = kind * (high - low + 1)
            fields.append((variable.name, kind))
        made[block.name] = type(block.name, (ctypes.Structure,), {"_fields_": fields})
    return made


def _compiled(program: str, folder: Path) -> ctypes.CDLL:
    compiler = shutil.which("gcc")
    if compiler is None:
        pytest.skip("gcc is not here: the exported text can't be executed")
    name = hashlib.sha256(program.encode()).hexdigest()[:16]  # a library is loaded once by its path
    source, library = folder / f"{name}.c", folder / f"{name}.so"
    source.write_text(program, encoding="ascii")
    subprocess.run([compiler, *FLAGS, str(source), "-o", str(library), "-lm"], check=True)
    return ctypes.CDLL(str(library))
