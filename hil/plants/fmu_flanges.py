"""An FMU with laws at its shafts: before each step their torques, from its own outputs, are added to its inputs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from estimator.diagnosis.flange import Flange, slots_of, with_only
from hil.recording.table import Column


class Flanges:
    """Puts the inputs of an instance before each of its steps.

    ``references`` are those of its variables. ``request`` has ``sign_width``, ``start_s`` and ``flanges``, each with
    ``speed``: an output; ``input``: the inputs that act on it, the first of which takes the laws' torque with ``sign``;
    ``laws``; ``inertia``. ``columns`` has ``time``, the inputs, ``p`` and ``angle``.
    """

    def __init__(
        self, instance: Any, references: Mapping[str, int], request: Mapping[str, Any], columns: Mapping[str, Column]
    ) -> None:
        self._instance, self._references, self._request = instance, references, request
        self._p, self._angle, self._time = columns["p"], columns["angle"], columns["time"]
        self._given = {name: each for name, each in columns.items() if name in references}
        kind = "Real" if hasattr(instance, "getReal") else "Float64"
        self._get, self._set = getattr(instance, f"get{kind}"), getattr(instance, f"set{kind}")
        self._flanges = [
            (each["speed"], each["input"], each["sign"], self._flange(each["laws"], each["inertia"]))
            for each in request["flanges"]
        ]
        self._step = instance.doStep
        instance.doStep = self._do_step

    def _flange(self, laws: Any, inertia: float) -> Flange:
        return Flange(with_only(self._p, slots_of(laws)), inertia, self._request["sign_width"])

    def _do_step(self, currentCommunicationPoint: float, communicationStepSize: float) -> Any:  # noqa: N803 - FMPy's
        time_s, step_s = currentCommunicationPoint, communicationStepSize
        k = int(np.searchsorted(self._time, time_s + 1e-6 * step_s, side="right")) - 1
        values = {name: float(column[k]) for name, column in self._given.items()}
        angle = float(np.interp(time_s, self._time, self._angle))
        for output, goes_to, sign, flange in self._flanges:
            speed = float(self._get([self._references[output]])[0])
            known = -sign * sum(values[name] for name in goes_to)
            against = flange.against(self._request["start_s"] + time_s, step_s, speed, angle, known)
            values[goes_to[0]] += sign * against
        self._set([self._references[name] for name in values], list(values.values()))
        return self._step(currentCommunicationPoint=time_s, communicationStepSize=step_s)
