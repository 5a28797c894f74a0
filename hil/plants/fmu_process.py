"""The process in which an FMU runs: a program of whoever made it, which may crash, end its process, or never return.

It is bounded in memory and in what it may write; a step that lasts longer than `STEP_S` ends the process, and so does
the end of the command it works for (`hil.recording.sandbox.serve`).
"""

from __future__ import annotations

import ctypes
import os
import threading
import time
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

import numpy as np

from hil.files import inside, is_plain
from hil.recording.sandbox import Document, limit, serve
from hil.recording.table import Column

STEP_S: Final = 30.0
"""Time for loading an FMU, and for each of its steps [s]."""

HUNG: Final = 97
"""Exit status where that was not enough."""

UNPACKED_BYTES: Final = 512 << 20
"""What an FMU may take unpacked; those of large tools take some 100 MB."""

MEMORY_BYTES: Final = 4 << 30

PIECE_BYTES: Final = 1 << 20

HOME: Final = "fmu"
"""Folder in the process's own that it is unpacked to."""


class _Watch:
    """Ends the process where nothing has happened for too long."""

    def __init__(self) -> None:
        self._since: float | None = None
        threading.Thread(target=self._run, name="watch", daemon=True).start()

    def happened(self) -> bool:
        self._since = time.monotonic()
        return True

    def rest(self) -> None:
        self._since = None

    def _run(self) -> None:
        while True:
            time.sleep(0.2)
            since = self._since
            if since is not None and time.monotonic() - since > STEP_S:
                os._exit(HUNG)


class Runner:
    """Opens one FMU and simulates it."""

    def __init__(self) -> None:
        self._watch = _Watch()
        self._described: Any = None

    def answer(self, request: Document, columns: Mapping[str, Column]) -> tuple[Document, Mapping[str, Column] | None]:
        """Open an FMU, or simulate the one that is open."""
        self._watch.happened()
        try:
            return self._open(Path(request["path"])) if request["what"] == "open" else self._run(request, columns)
        except Exception as error:  # noqa: BLE001 - FMPy and what it calls raise anything
            return {"problem": f"{error or type(error).__name__}"}, None
        finally:
            self._watch.rest()

    def _open(self, path: Path) -> tuple[Document, None]:
        import fmpy

        limit(MEMORY_BYTES, file_bytes=UNPACKED_BYTES)
        unpack(path, Path(HOME))
        self._described = fmpy.read_model_description(HOME)
        for kind in (self._described.coSimulation, self._described.modelExchange):
            if kind is not None and not is_plain(kind.modelIdentifier):
                raise ValueError(f"modelIdentifier {kind.modelIdentifier!r}, expected the plain name of a file")
        variables = [
            {"name": each.name, "causality": each.causality, "type": each.type, "start": each.start}
            for each in self._described.modelVariables
        ]
        kind = "CoSimulation" if self._described.coSimulation is not None else "ModelExchange"
        return {"variables": variables, "kind": kind}, None

    def _run(self, request: Document, columns: Mapping[str, Column]) -> tuple[Document, Mapping[str, Column]]:
        import fmpy

        rows = np.zeros(columns["time"].size, dtype=[(name, float) for name in columns])
        for name, values in columns.items():
            rows[name] = values
        is_stepped = request["kind"] == "CoSimulation"
        with _loaded((self._described.coSimulation if is_stepped else self._described.modelExchange).modelIdentifier):
            result = fmpy.simulate_fmu(
                str(Path(HOME).absolute()),  # FMPy makes an address of it
                model_description=self._described,
                fmi_type=request["kind"],
                stop_time=request["stop_s"],
                step_size=request["step_s"] if is_stepped else None,
                output_interval=request["step_s"],
                start_values=request["start"],
                input=rows,
                output=[request["output"]],
                step_finished=lambda *_: self._watch.happened(),
            )
        found = {"time": result["time"], "output": result[request["output"]]}
        return {}, {name: np.asarray(column, dtype=np.float64) for name, column in found.items()}


@contextmanager
def _loaded(identifier: str) -> Iterator[None]:
    """Load an FMU's binary before FMPy does, and unload it last: that may hang, and FMPy stops the watch meanwhile.

    It does not stay loaded: each simulation finds the binary's own variables as they are at first.
    """
    import fmpy

    folders = (fmpy.platform, fmpy.platform_tuple) if os.name == "posix" else ()  # FMI 2 and 3
    paths = [Path(HOME, "binaries", folder, identifier + fmpy.sharedLibraryExtension).absolute() for folder in folders]
    handles = [_system("dlopen", os.fsencode(path), os.RTLD_NOW) for path in paths if path.is_file()]
    try:
        yield
    finally:
        for handle in filter(None, handles):
            _system("dlclose", ctypes.c_void_p(handle))


def _system(name: str, *arguments: Any) -> Any:
    """Call a function of the system, without the interpreter's lock."""
    function = ctypes.CDLL(None)[name]
    function.restype = ctypes.c_void_p
    return function(*arguments)


def unpack(path: Path, home: Path) -> None:
    """Unpack an FMU into a folder, none of it elsewhere, no more of it than one may take."""
    room = UNPACKED_BYTES
    with zipfile.ZipFile(path) as archive:
        for entry in archive.infolist():
            target = inside(home, entry.filename.replace("\\", "/"))
            if entry.is_dir():
                target.mkdir(parents=True, exist_ok=True)
                continue
            target.parent.mkdir(parents=True, exist_ok=True)
            with archive.open(entry) as source, target.open("wb") as file:
                while piece := source.read(PIECE_BYTES):
                    room -= len(piece)
                    if room < 0:
                        raise ValueError(f"more than {UNPACKED_BYTES >> 20} MiB unpacked")
                    file.write(piece)


if __name__ == "__main__":
    serve(Runner().answer)
