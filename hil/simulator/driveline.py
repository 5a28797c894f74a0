"""A simulated driveline of the catalogue's physics, with its effects, as a plant."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimator.physics.catalogue import EFFECTS
from estimator.physics.effect import Effect, Element
from estimator.physics.kernel import integration
from estimator.physics.model import DrivelineModel, EffectValue, Motion, Parameter, Structure
from estimator.physics.simulate import SIGN_WIDTH_RAD_S, Stepper, output_state
from estimator.signals.record import FloatArray, Location, OutputKind, Record
from hil.config.model_file import read_model
from hil.config.rig_file import Rig, SimulationTable
from hil.errors import ModelFileError, UsageError
from hil.simulator.plc_device import PlcSetup
from hil.simulator.rig_server import required_simulation
from hil.simulator.simulated_rig import SimulatedPlant

FINER = 16
"""An acceleration is the slope over an integration step: this many times shorter than those of the simulation."""


DEFAULT_BUS = DrivelineModel(
    structure=Structure.TWO_MASS,
    parameters={
        "J_M": Parameter(1.6, 0.2),
        "J_L": Parameter(100.0, 0.2),
        "k": Parameter(4200.0, 0.2),
        "c": Parameter(9.0, 0.2),
        "b_M": Parameter(0.35, 0.2),
        "b_L": Parameter(0.9, 0.2),
    },
    gear_ratio=5.6,
)
"""A hybrid bus of 14 t, gear ratio 5.6, wheel radius 0.48 m, reflected to the motor shaft.

Assumed, for the paper gives no parameter values: first resonance 8.2 Hz, inside the 5 to 50 Hz band it names.
"""

NO_EXPERIMENT_S = 60.0  # length of the widest recording where the rig file has no experiment [s]


@dataclass(frozen=True, slots=True)
class EffectSpec:
    """An effect put into the simulated rig: its name in the catalogue and the parameters given for it."""

    name: str  # not checked here
    parameters: Mapping[str, float]  # in the catalogue's units; those left out have its defaults

    @classmethod
    def parse(cls, text: str) -> EffectSpec:
        """Read ``NAME[:k=v,...]``."""
        name, _, rest = text.partition(":")
        if not name.strip():
            raise UsageError(f"effect {text!r}: expected NAME:key=number, got no name. List them by: hil effects")
        parameters: dict[str, float] = {}
        for part in rest.split(",") if rest else ():
            key, value = _parameter(text, part)
            if key in parameters:
                raise UsageError(f"effect {text!r}: expected {key!r} once, got twice. Leave one out.")
            parameters[key] = value
        return cls(name.strip(), parameters)


def simulation_model(table: SimulationTable, trust_laws: bool = False) -> DrivelineModel:
    """Model of the simulated driveline: the rig file's, or the default bus; its own laws run only where trusted."""
    if table.model is None:
        return DEFAULT_BUS
    file = read_model(table.model, trust_laws)
    if file.on_bench:
        raise ModelFileError(table.model, "structure | expected a driveline for a rig to drive | got 'joint'")
    return file.model


class DrivelinePlant(Stepper):
    """A driveline with its effects, stepped by the estimator's own simulation; more to measure than the motor's speed.

    Both inverters turn one shaft. This plant shares its physics with what is fitted: it is for trying things out, the
    proof has a plant of its own.
    """

    def __init__(self, model: DrivelineModel, period_s: float) -> None:
        super().__init__(model, period_s)
        self._structure = model.structure
        self.step(0.0, 0.0)  # at rest, where nothing moves: the compiler must not run in the first SYNC

    def measured(self, kind: OutputKind, at: Location) -> float:
        """Return what an ideal sensor shows now, an acceleration as under the torque that acts until now.

        It is the output before a step that is not taken, or the slope at its beginning.
        """
        is_slope = kind is OutputKind.ACCELERATION
        size, last = self._torque.size, self._torque.size - 1
        out, slopes = np.zeros((1, size)), np.zeros((2, size))
        integration.integrate_period(
            self._masses,
            (),
            self._period_s,
            FINER * self._substeps if is_slope else self._substeps,
            SIGN_WIDTH_RAD_S,
            last,
            size,
            (self._steps - last) * self._period_s,
            np.append(self._torque[1:], self._torque[-1]),
            self._load,
            self._angle,
            np.zeros(0),
            self._p,
            self._state.copy(),
            np.array([output_state(_recording_of(kind, at), self._structure)]),
            False,
            out,
            slopes,
        )
        return float(slopes[1, last] if is_slope else out[0, last])

    def advance(self, torque_nm: tuple[float, float], duration_s: float) -> None:
        """Let the driveline run with both torques held [Nm] for one period."""
        if duration_s != self._period_s:
            raise ValueError(
                f"driveline: asked for a step of {duration_s:g} s, expected the {self._period_s:g} s it was made "
                "for. Make the plant with the rig's own period_s."
            )
        self.step(*torque_nm)


def _recording_of(kind: OutputKind, at: Location) -> Record:
    """Return a recording of such an output, as a model is asked for one."""
    nothing = np.zeros(1)
    return Record("channel", 1.0, nothing, nothing[:, np.newaxis], nothing, np.ones(1, dtype=np.bool_), kind, at)


def out_of_bounds(rig: Rig, model: DrivelineModel, name: str, values: Mapping[str, float]) -> Iterator[str]:
    """Name every parameter of an effect that is outside its bounds."""
    effect = EFFECTS[name]
    scales = effect.scales(model, [_widest_record(rig)])
    for parameter, scale in zip(effect.shared_parameters, scales, strict=True):
        low, high = scale * parameter.low, scale * parameter.high
        value = values.get(parameter.name)
        is_left_out = parameter.optional and value == parameter.null  # wherever its bounds begin
        if value is not None and not low <= value <= high and not is_left_out:
            unit = parameter.unit(model.motion).removeprefix("1")  # what has no unit has "1"
            yield (
                f"effect {name!r}: {parameter.name} is {value:g}, expected {f'{low:.3g} to {high:.3g} {unit}'.strip()}"
                ", the catalogue's bounds at this rig's period and limits of torque and speed"
            )


def _widest_record(rig: Rig) -> Record:
    """Make a recording at the rig's limits, one way and then the other."""
    duration_s = max((table.duration_s for table in rig.experiments.values()), default=NO_EXPERIMENT_S)
    samples = max(2, round(duration_s / rig.period_s))
    time_s: FloatArray = np.arange(samples, dtype=np.float64) * rig.period_s
    direction = np.where(np.arange(samples) < samples // 2, 1.0, -1.0)
    return Record(
        name="limits of the rig",
        sample_time_s=rig.period_s,
        time_s=time_s,
        torque_nm=rig.guard.sum_limit_nm * direction[:, np.newaxis],
        output=PlcSetup().speed_limit_rad_s * direction,
        okay=np.ones(samples, dtype=bool),
    )


def plant_for(rig: Rig, effects: Sequence[EffectSpec] = (), trust_laws: bool = False) -> SimulatedPlant:
    """Build the driveline of a rig file."""
    model = simulation_model(required_simulation(rig), trust_laws)
    if model.motion is not Motion.ROTATION:
        raise UsageError(
            f"rig {rig.name!r}, simulation.model: expected motion = 'rotation', got {model.motion.value!r}: "
            "its inverters turn a shaft. Name another model."
        )
    names = [effect.name for effect in effects]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise UsageError(f"effect {twice[0]!r}: expected once, got twice. Give all its parameters in one --effect.")
    for effect in effects:
        _require_parameters(effect)
    changed = replace(model, effects={**model.effects, **{effect.name: _values(effect) for effect in effects}})
    _refuse_absent(changed)
    faults = [fault for effect in effects for fault in out_of_bounds(rig, changed, effect.name, effect.parameters)]
    if faults:
        raise UsageError("\n".join(f"{fault}. Check its unit: hil effects NAME has the law." for fault in faults))
    return DrivelinePlant(changed, rig.period_s)


def _values(effect: EffectSpec) -> dict[str, EffectValue]:
    entry = EFFECTS.get(effect.name)
    parameters = effect.parameters if entry is None else entry.completed(effect.parameters)
    return {key: EffectValue(value) for key, value in parameters.items()}


def _require_parameters(effect: EffectSpec) -> None:
    entry = EFFECTS.get(effect.name)
    if entry is None or effect.parameters:
        return
    known = ", ".join(parameter.name for parameter in entry.parameters)
    raise UsageError(
        f"effect {effect.name!r}: expected at least one of its parameters ({known}), got none, which does "
        f"nothing. Write {effect.name}:{entry.parameters[0].name}=..."
    )


def _refuse_absent(model: DrivelineModel) -> None:
    """Refuse what this plant has no place for: a course over time, an acquisition, an event without moments."""
    for name, values in model.effects.items():
        if reason := _reason_absent(EFFECTS[name], values):
            raise UsageError(
                f"effect {name!r}: {reason}. Take it out of --effect, or [effects.{name}] out of simulation.model. A "
                f"recording that has it: python -m hil.proof.make_case --effect {name} --seed 1 --out DIR"
            )


def _reason_absent(entry: Effect, values: Mapping[str, EffectValue]) -> str:
    if entry.profile:
        return (
            "expected an effect with a constant law, got one that is a profile over each recording's own time "
            f"({entry.law}): the simulated rig would drive without it"
        )
    if entry.element is Element.ACQUISITION:
        return "expected an effect of the driveline or its sensor, got one of the acquisition (see --fault)"
    if entry.event and not {"from_s", "to_s"} <= set(values):
        return "expected from_s and to_s too, the moments between which it acts, got none"
    return ""


def _parameter(text: str, part: str) -> tuple[str, float]:
    key, _, value = part.partition("=")
    try:
        return key.strip(), float(value)
    except ValueError as error:
        raise UsageError(
            f"effect {text!r}: expected key=number, got {part!r}. Write NAME:key=number,key=number."
        ) from error
