"""Arrays next to scalars at the inputs of a co-simulation: FMPy takes inputs of one shape at a time only."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from typing import Any

import numpy as np

from estimator.signals.record import FloatArray


class Inputs:
    """Puts the inputs of an instance of FMI 3.0 before each of its steps.

    ``variables`` are those of its description by name; ``given`` has the values of inputs over ``time_s``, (N,), of
    shape (N,) or (N, …).
    """

    def __init__(self, instance: Any, variables: Mapping[str, Any], time_s: FloatArray, given: Mapping[str, Any]):
        self._instance, self._time_s = instance, time_s
        self._of_type: defaultdict[str, list[tuple[int, FloatArray]]] = defaultdict(list)
        for name, values in given.items():
            rows = np.asarray(values, dtype=np.float64).reshape(time_s.size, -1)
            self._of_type[variables[name].type].append((int(variables[name].valueReference), rows))
        self._step = instance.doStep
        instance.doStep = self._do_step

    def _do_step(self, currentCommunicationPoint: float, communicationStepSize: float) -> Any:  # noqa: N803 - FMPy's
        for kind, inputs in self._of_type.items():
            values = [np.interp(currentCommunicationPoint, self._time_s, x) for _, rows in inputs for x in rows.T]
            getattr(self._instance, f"set{kind}")([reference for reference, _ in inputs], values)
        return self._step(
            currentCommunicationPoint=currentCommunicationPoint, communicationStepSize=communicationStepSize
        )
