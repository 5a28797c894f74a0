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

from drivers.foreign_file import open_regular
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


MOST_EVENTS: Final = 1000
"""Steps and events in a row that a period of the recording may take."""


class _Watch:
    """Ends the process where nothing has happened for too long."""

    def __init__(self) -> None:
        self._since: float | None = None
        threading.Thread(target=self._run, name="watch", daemon=True).start()

    def happened(self) -> None:
        self._since = time.monotonic()

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
        self._arrays: dict[str, tuple[int, ...]] = {}
        os.environ["TMPDIR"] = str(Path().absolute())  # what an FMU leaves there goes with this process's folder

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
        kind = "CoSimulation" if self._described.coSimulation is not None else "ModelExchange"
        _require_simulated(self._described, kind)
        self._arrays = {each.name: each.shape for each in self._described.modelVariables if each.shape}
        variables = [
            {"name": name, "causality": each.causality, "type": each.type, "start": start, **_more(each)}
            for each in self._described.modelVariables
            for name, start in elements(each.name, each.shape, each.start)
        ]
        return {"variables": variables, "kind": kind}, None

    def _run(self, request: Document, columns: Mapping[str, Column]) -> tuple[Document, Mapping[str, Column]]:
        import fmpy

        is_stepped = request["kind"] == "CoSimulation"
        output, place = self._array_of(request["output"])
        start: dict[str, Any] = {}
        for name, value in request["start"].items():
            self._put(start, name, value)
        given: dict[str, Any] = {}
        for name, values in columns.items() if "around" not in request else ():
            self._put(given, name, values)
        rows = np.zeros(columns["time"].size, dtype=[(name, float, each.shape[1:]) for name, each in given.items()])
        for name, values in given.items():
            rows[name] = values
        home = str(Path(HOME).absolute())  # FMPy makes an address of it
        with _loaded((self._described.coSimulation if is_stepped else self._described.modelExchange).modelIdentifier):
            instance = None
            if "around" in request:
                instance = self._with_laws(home, request["around"], columns)
            elif len({each.shape for name, each in given.items() if name != "time"}) > 1:
                time_s = given.pop("time")
                instance = self._with_inputs(home, is_stepped, time_s, given)
                start |= {name: each[0] for name, each in given.items()}
            result = fmpy.simulate_fmu(
                home,
                model_description=self._described,
                fmi_type=request["kind"],
                stop_time=request["stop_s"],
                step_size=request["step_s"] if is_stepped else None,
                output_interval=request["step_s"],
                start_values={
                    name: np.ravel(value) if name in self._arrays else value for name, value in start.items()
                },
                input=None if instance else rows,
                fmu_instance=instance,
                output=[output],
                step_finished=_Progress(self._watch, request["step_s"]),
            )
            if instance is not None:
                instance.freeInstance()
        found = {"time": result["time"], "output": result[output][(slice(None), *place)]}
        return {}, {name: np.asarray(column, dtype=np.float64) for name, column in found.items()}

    def _with_laws(self, home: str, around: Document, columns: Mapping[str, Column]) -> Any:
        """Return an instance whose inputs take the torques of laws at its shafts, too."""
        from fmpy.simulation import instantiate_fmu

        from hil.plants.fmu_flanges import Flanges

        instance = instantiate_fmu(home, self._described, "CoSimulation")
        references = {each.name: each.valueReference for each in self._described.modelVariables}
        Flanges(instance, references, around, columns)
        return instance

    def _with_inputs(self, home: str, is_stepped: bool, time_s: Column, given: Mapping[str, Any]) -> Any:
        """Return an instance that is given arrays and scalars before each step."""
        from fmpy.simulation import instantiate_fmu

        from hil.plants.fmu_inputs import Inputs

        if not is_stepped:
            raise ValueError("arrays next to scalars at the inputs of a model exchange: export it for co-simulation")
        instance = instantiate_fmu(home, self._described, "CoSimulation")
        Inputs(instance, {each.name: each for each in self._described.modelVariables}, time_s, given)
        return instance

    def _array_of(self, name: str) -> tuple[str, tuple[int, ...]]:
        """Return the variable that an element such as ``A[1,2]`` is of, and its place; of others themselves."""
        array, _, places = name.rpartition("[")
        if array not in self._arrays:
            return name, ()
        return array, tuple(int(each) - 1 for each in places.rstrip("]").split(","))

    def _put(self, into: dict[str, Any], name: str, value: Any) -> None:
        """Put a value in its variable's place; the other elements of an array keep their start."""
        array, place = self._array_of(name)
        if not place:
            into[name] = value
            return
        if array not in into:
            variable = next(each for each in self._described.modelVariables if each.name == array)
            starts = np.array([number(each) for _, each in elements(array, variable.shape, variable.start)])
            into[array] = np.broadcast_to(starts.reshape(variable.shape), (*np.shape(value), *variable.shape)).copy()
        into[array][(..., *place)] = value


def elements(name: str, shape: tuple[int, ...] | None, start: Any) -> Iterator[tuple[str, Any]]:
    """Yield the names and starts of an array's elements, counted from 1; of a scalar its own."""
    if not shape:
        yield name, start
        return
    values = (start.split() if isinstance(start, str) else list(start)) if start else []
    for i, place in enumerate(np.ndindex(*shape)):
        at = ",".join(str(each + 1) for each in place)
        yield f"{name}[{at}]", values[i] if i < len(values) else None


def number(start: object) -> float:
    """Return a start as a number; 0 where a file says anything else."""
    try:
        return float(start or 0.0)  # type: ignore[arg-type]  # whatever a file says
    except (TypeError, ValueError):
        return 0.0


def _more(variable: Any) -> dict[str, str]:
    """Return what else tells what a variable is: its unit and whether it may change."""
    unit = variable.unit or getattr(variable.declaredType, "unit", None)
    return {"unit": unit or "", "variability": variable.variability or ""}


def _require_simulated(described: Any, kind: str) -> None:
    """See that an FMU is of this platform, and has nothing that is not simulated here."""
    import fmpy

    if clocks := [each.name for each in described.modelVariables if each.type == "Clock"]:
        raise ValueError(f"the clock {clocks[0]!r}: FMUs with clocks are not simulated; export it without them")
    of_kind = described.coSimulation if kind == "CoSimulation" else described.modelExchange
    platform = fmpy.platform_tuple if described.fmiVersion.startswith("3") else fmpy.platform
    folder, library = Path(HOME, "binaries"), f"{of_kind.modelIdentifier}{fmpy.sharedLibraryExtension}"
    if not (folder / platform / library).is_file():
        has = sorted(each.name for each in folder.iterdir()) if folder.is_dir() else []
        raise ValueError(f"binaries for {', '.join(has) or 'no platform'}: export it for this one, {platform}")


class _Progress:
    """Tells the watch of each period an FMU has simulated, and ends one in which only event follows event."""

    def __init__(self, watch: _Watch, period_s: float) -> None:
        self._watch, self._period_s = watch, period_s
        self._since_s, self._count = 0.0, 0

    def __call__(self, time_s: float, _recorder: object) -> bool:
        self._count += 1
        if time_s >= self._since_s + self._period_s:
            self._since_s, self._count = time_s, 0
            self._watch.happened()
        if self._count > MOST_EVENTS:
            raise ValueError(f"more than {MOST_EVENTS} steps or events at {time_s:.6g} s within {self._period_s:g} s")
        return True


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
    with open_regular(path) as packed, zipfile.ZipFile(packed) as archive:
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
