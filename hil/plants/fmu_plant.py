"""Another program's model as an FMU, simulated by FMPy.

An FMU is a program from whoever made it: it runs only where it is trusted, in a process of its own
(`hil.plants.fmu_process`).
"""

from __future__ import annotations

import importlib.util
import signal
import threading
import time
import weakref
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import MappingProxyType

import numpy as np

from estimator.diagnosis.segments import tiles
from estimator.least_squares import minimise
from estimator.physics.driveline import InitialCondition
from estimator.physics.free_run import FreeRun
from estimator.physics.model import Motion
from estimator.physics.parallel import TimeIsUp, check_time, concurrently, time_left_s
from estimator.signals.record import FloatArray, OutputKind, Record
from hil.errors import UsageError
from hil.plants.fmu_process import HUNG, MEMORY_BYTES, STEP_S, number
from hil.plants.names import Names, names, some
from hil.printable import printable
from hil.recording.sandbox import Document, Gone, Sandbox
from hil.recording.table import Column
from hil.version import install_hint

ROUNDS = 20
"""Jacobians at most; two or three do where the output is nearly linear in a load and an initial state."""

SMALL = 1e-3
"""Step of a difference, in the scale of what is estimated."""

NUMBERS = ("Real", "Float64", "Float32")
"""Types of inputs that are given."""

LONGEST_S = 86400.0
"""Time for a simulation of any length [s]; one that hangs is ended long before (`hil.plants.fmu_process`)."""

ENDED = "See that it simulates these torques in the program that made it."
"""What to do about an FMU that crashes or hangs. What one says of itself is its own cure, or none."""

SEVERAL = "Where only one of it may run at a time: --jobs 1."

NO_CHANGE: Mapping[str, float] = MappingProxyType({})

SHARE_OF_RANGE = 0.1
"""Scale of a load or an initial state, over the range of the torque or the output."""


def is_fmu(path: Path) -> bool:
    """Tell whether a path is that of an FMU."""
    return path.suffix.lower() == ".fmu"


class FmuPlant:
    """The model in an FMU."""

    motion = Motion.ROTATION

    def __init__(self, path: Path, mapped: Sequence[str], trusted: bool) -> None:
        if not trusted:
            raise UsageError(
                f"{path}: an FMU is a program of whoever made it, and runs only where you trust it: --trust-fmu"
            )
        self.name = path.name
        if importlib.util.find_spec("fmpy") is None:
            raise UsageError(f"expected FMPy, which simulates FMUs, got none. Install it: {install_hint('fmu')}")
        self._path, self._is_ended = path.absolute(), False
        self._idle, self._every, self._free = list[Sandbox](), list[Sandbox](), threading.Condition()
        self._opening_s = self._worked_s = 0.0
        process, described = self._opened()
        self._idle.append(process)
        variables = {str(each["name"]): each for each in described["variables"]}
        self._kind: str = described["kind"]
        self._mapped, self._known = tuple(mapped), tuple(variables)
        names(mapped, variables)
        self.simulations = 0
        self._variables, self._settled = variables, dict[tuple[str, float], FloatArray]()
        self._inputs = [
            name for name, each in variables.items() if each["causality"] == "input" and each["type"] in NUMBERS
        ]

    def _opened(self) -> tuple[Sandbox, Document]:
        """Start a process of the FMU, and return what it says of itself."""
        began_s = time.monotonic()
        process = Sandbox("hil.plants.fmu_process")
        self._every.append(process)
        weakref.finalize(self, process.end)
        request = {"what": "open", "path": str(self._path)}
        said = self._asked(process, request, f"{self._path}: expected an FMU of FMI 1.0, 2.0 or 3.0")[0]
        self._opening_s = time.monotonic() - began_s
        return process, said

    @property
    def _several(self) -> list[str]:
        return [SEVERAL] if len(self._every) > 1 else []

    @contextmanager
    def _process(self) -> Iterator[Sandbox]:
        """Take an idle process: one more, where none is and they have worked for longer than an opening lasts."""
        with self._free:
            self._free.wait_for(lambda: self._idle or self._worked_s >= self._opening_s)
            idle = self._idle.pop() if self._idle else None
        process = idle or self._opened()[0]
        began_s = time.monotonic()
        try:
            yield process
        finally:
            with self._free:
                self._worked_s += time.monotonic() - began_s
                self._idle.append(process)
                self._free.notify_all()

    def _asked(
        self, process: Sandbox, request: Document, expected: str, columns: Mapping[str, Column] | None = None
    ) -> tuple[Document, dict[str, Column]]:
        """Have a process of the FMU do something; a `UsageError` says what it did instead."""
        check_time()
        if self._is_ended:
            raise TimeIsUp
        limit_s, began_s = min(LONGEST_S, time_left_s()), time.monotonic()
        try:
            document, answered = process.ask(request, limit_s, columns)
        except Gone:
            status = process.end(at_once=False)
            took_s = time.monotonic() - began_s
            if time_left_s() < 0.0:  # it was ended, and did not end
                self._is_ended = True
                raise TimeIsUp from None
            ended = f"one that does not return in {limit_s:g} s" if took_s >= limit_s else _ended(status)
            raise UsageError(" ".join([f"{expected}, got {ended}. {ENDED}", *self._several])) from None
        except BaseException:  # Ctrl-C, for one: they may not return by themselves
            for each in [*self._every]:
                each.end()
            raise
        if "problem" in document:
            problem = printable(str(document["problem"])).rstrip(".")
            raise UsageError(" ".join([f"{expected}, got: {problem}.", *self._several]))
        return document, answered

    def run(self, record: Record) -> FreeRun:
        """Simulate a recording; load torque and initial state are estimated where the FMU has them.

        After a long gap the simulation begins anew, as that of a model file does.
        """
        runs = [self._run(part) for part in tiles(record)]
        output = np.concatenate([run.output for run in runs])
        error = (output - record.output)[record.okay]
        longest = max(runs, key=lambda run: run.output.size)
        return FreeRun(output, float(np.sqrt(np.mean(error**2))), longest.start)

    def _run(self, record: Record) -> FreeRun:
        named = self.named(record.kind)
        unknown = _Unknown.of(named, record)
        x, output = self._fitted(record, named, unknown)
        self._settled[record.name, float(record.time_s[0])] = x
        error = (output - record.output)[record.okay]
        load = float(x[0] * unknown.scale[0]) if named.load else float("nan")
        return FreeRun(output, float(np.sqrt(np.mean(error**2))), InitialCondition(load, 0.0, float("nan")))

    def _fitted(self, record: Record, named: Names, unknown: _Unknown) -> tuple[FloatArray, FloatArray]:
        """Return load and initial state (K,) with which the output (N,) follows a recording best.

        Begun from what is recorded first, or from the FMU's own start where that follows it better.
        """
        known = dict[bytes, FloatArray]()

        def output(x: FloatArray) -> FloatArray:
            if (key := x.tobytes()) not in known:
                known[key] = self._simulated(record, named, unknown, x)
            return known[key]

        def residual(x: FloatArray) -> FloatArray:
            return (output(x) - record.output)[record.okay]

        def jacobian(x: FloatArray) -> FloatArray:
            moved = concurrently(partial(self._simulated, record, named, unknown), list(x + SMALL * np.eye(x.size)))
            return np.array([(each - output(x))[record.okay] / SMALL for each in moved]).T

        own = np.array([number(self._variables[name]["start"]) for name in unknown.names]) / unknown.scale
        x = min((unknown.guess, own), key=lambda each: float(np.sum(residual(each) ** 2)))
        if x.size:
            free = np.full(x.size, np.inf)
            x = minimise(residual, jacobian, x, -free, free, ROUNDS).x
        return x, output(x)

    def settled(self, record: Record, named: Names) -> dict[str, FloatArray | float]:
        """Return load and initial state that were found of a recording, where it was `run`, by the FMU's names."""
        unknown = _Unknown.of(named, record)
        x = self._settled.get((record.name, float(record.time_s[0])), unknown.guess)
        return dict(zip(unknown.names, (x * unknown.scale).tolist(), strict=True))

    def changed(self, record: Record, values: Mapping[str, float]) -> FloatArray:
        """Simulate a recording that was `run` with some parameters changed, its load and initial state kept."""
        named, parts = self.named(record.kind), []
        for part in tiles(record):
            x = self._settled[record.name, float(part.time_s[0])]
            parts.append(self._simulated(part, named, _Unknown.of(named, part), x, values))
        return np.concatenate(parts)

    def named(self, kind: OutputKind) -> Names:
        """Return which of its variables are what, for a kind of output."""
        found = names(self._mapped, self._known, kind)
        for name in found.torque:
            if name not in self._inputs:
                raise UsageError(
                    f"--map torque={name}: expected an input of the FMU. It has: {', '.join(self._inputs)}"
                )
        if found.output in self._inputs:
            raise UsageError(f"--map output={found.output}: expected an output of the FMU, got an input")
        return found

    def takes_laws(self, named: Names) -> bool:
        """Tell whether torques can be put at its inputs step by step: in co-simulation, at scalars."""
        used = (*named.torque, named.output, named.load, named.load_speed)
        return self._kind == "CoSimulation" and not any(name.endswith("]") for name in used)

    def is_input(self, name: str) -> bool:
        """Tell whether a variable is an input, which may change over time."""
        return name in self._inputs

    def parameter(self, name: str) -> tuple[float, str]:
        """Return the start and the unit of a parameter that can be set."""
        found = self._variables.get(name)
        settable = [
            n for n, each in self._variables.items() if each["causality"] == "parameter" and each["type"] in NUMBERS
        ]
        if found is None or name not in settable:
            raise UsageError(f"--tune {name}: expected a real parameter of the FMU. It has: {some(settable)}")
        if (value := number(found["start"])) == 0.0:
            raise UsageError(f"--tune {name}: expected a start other than 0, of which a share can be taken")
        return value, str(found["unit"])

    def _simulated(
        self, record: Record, named: Names, unknown: _Unknown, x: FloatArray, changed: Mapping[str, float] = NO_CHANGE
    ) -> FloatArray:
        values: dict[str, FloatArray | float] = {**changed}
        values |= dict(zip(unknown.names, (x * unknown.scale).tolist(), strict=True))
        if record.load_nm is not None:
            if named.load not in self._inputs:
                raise UsageError(
                    f"{self.name}: recording {record.name} has a measured load torque: expected an FMU with an input "
                    f"for it, got none named {named.load!r}. Name it: --map load=NAME, or take load out of [signals]."
                )
            values[named.load] = values.get(named.load, 0.0) + record.load_nm
        return self.simulated(record, named, record.torque_nm, values)

    def simulated(
        self,
        record: Record,
        named: Names,
        torque_nm: FloatArray,
        values: Mapping[str, FloatArray | float],
        around: tuple[Document, dict[str, Column]] | None = None,
        parts: int = 1,
    ) -> FloatArray:
        """Simulate the output of a recording, shape (N,); with laws ``around`` it, in parts of its period."""
        with self._free:
            self.simulations += 1
        held = {name: value for name, value in values.items() if name in self._inputs}
        start = {name: value for name, value in values.items() if name not in self._inputs}
        since_s = record.time_s - record.time_s[0]
        request = {
            "what": "run",
            "kind": self._kind,
            "stop_s": float(since_s[-1]),
            "step_s": record.sample_time_s / parts,
            "start": {name: float(np.asarray(value)) for name, value in start.items()},
            "output": named.output,
        }
        columns = self._given(torque_nm, named, since_s, held)
        if around is not None:
            request["around"], columns = around[0], {**columns, **around[1]}
        expected = f"{self.name}: expected an FMU that simulates {record.name}"
        with self._process() as process:
            result = self._asked(process, request, expected, columns)[1]
        output = np.interp(since_s, result["time"], result["output"])
        if not np.isfinite(output).all():
            used = ", ".join(f"{name} = {float(np.mean(value)):.4g}" for name, value in values.items())
            raise UsageError(
                f"{self.name}: expected a finite {named.output} over {record.name}, got NaN or infinity"
                f"{f' with {used}' if used else ''}. See that what --map names as load and start is what it is."
            )
        return np.asarray(output, dtype=np.float64)

    def _given(
        self, torque_nm: FloatArray, named: Names, since_s: FloatArray, held: Mapping[str, FloatArray | float]
    ) -> dict[str, Column]:
        """Return the inputs over time; each torque is held until the next, in model exchange by a step."""
        torques = torque_nm if len(named.torque) > 1 else torque_nm.sum(axis=1, keepdims=True)
        values = {**dict(zip(named.torque, torques.T, strict=False)), **held}  # the others keep their start
        columns: dict[str, Column] = {"time": since_s}
        columns |= {name: np.array(np.broadcast_to(value, since_s.size), dtype=float) for name, value in values.items()}
        if self._kind == "CoSimulation":
            return columns
        steps = {name: np.repeat(column, 2)[:-1] for name, column in columns.items()}
        steps["time"][1::2] = since_s[1:]
        return steps


@dataclass(frozen=True, slots=True)
class _Unknown:
    """What is estimated of a recording: names in the FMU, scales and where the search starts, (K,)."""

    names: tuple[str, ...]
    scale: FloatArray
    guess: FloatArray

    @classmethod
    def of(cls, known: Names, record: Record) -> _Unknown:
        torque, output = np.ptp(record.total_torque_nm), np.ptp(record.output[record.okay])
        first = float(record.output[record.okay][0])
        scales = [(known.load, SHARE_OF_RANGE * torque or 1.0, 0.0)] if known.load else []
        size = SHARE_OF_RANGE * output or 1.0
        measured = "angle" if record.kind is OutputKind.POSITION else "speed"
        for name in known.start:
            is_measured = measured in name
            scales.append((name, size if is_measured else SHARE_OF_RANGE * size, first / size if is_measured else 0.0))
        return cls(
            tuple(n for n, _, _ in scales), np.array([s for _, s, _ in scales]), np.array([g for *_, g in scales])
        )


def _ended(status: int) -> str:
    """Say how the process of an FMU ended."""
    if status == HUNG:
        return f"one of which a step, or the loading, lasts longer than {STEP_S:g} s"
    if status < 0:
        return f"one that crashes ({signal.Signals(-status).name}) or needs more than {MEMORY_BYTES >> 30} GiB"
    return f"one that ends its process (exit status {status})"
