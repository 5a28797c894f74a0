"""Worlds of a rigid-body engine (MuJoCo): a line of bodies, joints and tendons as robotics writes it.

Dry friction is the engine's constraint, regularised in its own way; a dead band is a tendon whose damper acts in the
gap; a generator comes in by an equality of two joints; what changes at a moment is changed in the model. MuJoCo is a
dependency of development, for the campaign alone.
"""

from collections.abc import Callable, Mapping
from functools import partial
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from hil.proof.truth.bus import PERIOD_S, Bus, draw_bus, draw_nominal
from hil.proof.truth.case import TESTS, Case
from hil.proof.truth.hidden import log_uniform
from hil.proof.truth.physics import FloatArray
from hil.proof.truth.specimen import NOTHING, Specimen, Stream, stream
from tests.campaigns.forms import SETTLING_S, Line, Role, record

ROLE = Role.JUDGE


class Solver(NamedTuple):
    """How the engine integrates."""

    step_s: float
    method: str


SOLVERS = tuple(Solver(*each) for each in product((2e-4, 5e-4, 1e-3), ("implicitfast", "Euler")))
"""Steps of a fiftieth to a tenth of a period, implicit and explicit; each round of effects has the next one."""

NEVER_S = 1e6  # after the end of every recording

GENERATOR_BEHIND = 0.97
"""Speed of the generator over the motor's before its clutch closes."""

NO_FRICTION_NM = 1e-9
"""What the engine keeps a place for and nobody sees."""

Sizes = dict[str, float]
Draw = Callable[[np.random.Generator, Bus], Sizes]


def _friction(rng: np.random.Generator, bus: Bus) -> Sizes:
    return {"dry_nm": log_uniform(rng, 4.0, 60.0)}


def _mode(rng: np.random.Generator, bus: Bus) -> Sizes:
    """A further inertia behind the load's end of the shaft or at the motor's, 15 to 50 Hz."""
    at_motor = bool(rng.random() < 0.5)
    inertia = bus.J_M * (log_uniform(rng, 0.12, 0.4) if at_motor else log_uniform(rng, 0.4, 2.0))
    return {"at_motor": float(at_motor), "inertia": inertia, "stiffness": bus.k * log_uniform(rng, 3.0, 8.0)}


def _step(rng: np.random.Generator, bus: Bus) -> Sizes:
    """A seat that settles is a few per cent; a crack is 25 to 40, and may close again."""
    size, from_s = log_uniform(rng, 0.02, 0.4), rng.uniform(5.0, 20.0)
    until_s = from_s + rng.uniform(4.0, 9.0) if rng.random() < 0.5 else NEVER_S
    return {"step": -size if rng.random() < 0.75 else size, "from_s": from_s, "to_s": until_s}


def _generator(rng: np.random.Generator, bus: Bus) -> Sizes:
    from_s = rng.uniform(4.0, 15.0)
    return {
        "inertia": bus.J_M * log_uniform(rng, 0.02, 0.12),
        "from_s": from_s,
        "to_s": from_s + rng.uniform(5.0, 13.0),
    }


def _payload(rng: np.random.Generator, bus: Bus) -> Sizes:
    size = log_uniform(rng, 0.06, 0.5)
    return {"share": size if rng.random() < 0.5 else -size, "at_s": rng.uniform(6.0, 22.0)}


def _brake(rng: np.random.Generator, bus: Bus) -> Sizes:
    from_s = rng.uniform(5.0, 15.0)
    return {"brake_nm": log_uniform(rng, 30.0, 120.0), "from_s": from_s, "to_s": from_s + rng.uniform(5.0, 12.0)}


EFFECTS: Mapping[str, Draw] = {
    NOTHING: lambda rng, bus: {},
    "coulomb_friction_motor": _friction,
    "backlash": lambda rng, bus: {"gap_rad": log_uniform(rng, 0.003, 0.06)},
    "extra_torsional_mode": _mode,
    "stiffness_change": _step,
    "coulomb_friction_load": _friction,
    "generator_coupled": _generator,
    "inertia_change": _payload,
    "brake_drag": _brake,
    "aerodynamic_drag": lambda rng, bus: {"drag": log_uniform(rng, 0.01, 0.12)},
    "actuator_lag": lambda rng, bus: {"lag_s": log_uniform(rng, 0.003, 0.025)},
    "torque_saturation": lambda rng, bus: {"limit_nm": log_uniform(rng, 300.0, 480.0)},
    "load_imbalance": lambda rng, bus: {"imbalance_nm": log_uniform(rng, 6.0, 60.0)},
}
"""What the engine conceals, each seed the next one."""


def make_engine(seed: int) -> Case:
    """Draw a bus, build it in the engine, record its three tests."""
    bus, effect = draw_bus(stream(seed, Stream.BUS)), list(EFFECTS)[seed % len(EFFECTS)]
    sizes = EFFECTS[effect](np.random.default_rng([seed, len("engine")]), bus)
    line = Line(bus.J_M, bus.J_L, bus.k, bus.c, bus.b_M, bus.b_L, bus.load_torque_nm)
    line = line._replace(dry_nm=sizes.get("dry_nm", 0.0), drag=sizes.get("drag", 0.0))
    specimen = Specimen(effect, seed, bus, draw_nominal(bus, stream(seed, Stream.NOMINAL)), {effect: sizes})
    solver = SOLVERS[seed // len(EFFECTS) % len(SOLVERS)]
    recordings = (record(seed, test, line, partial(_drive, bus, effect, sizes, solver=solver)) for test in TESTS)
    return Case(specimen, tuple(recordings), ())


def _body(name: str, inertia: float, damping: float = 0.0, friction: float = 0.0) -> str:
    return (
        f'<body name="{name}"><inertial pos="0 0 0" mass="1" diaginertia="{inertia} {inertia} {inertia}"/>'
        f'<joint name="{name}" type="hinge" axis="0 0 1" damping="{damping}" frictionloss="{friction}"/></body>'
    )


def _tendon(name: str, ends: tuple[str, str], stiffness: float, damping: float, gap_rad: float = 0.0) -> str:
    joints = f'<joint joint="{ends[0]}" coef="1"/><joint joint="{ends[1]}" coef="-1"/>'
    slack = f'springlength="{-0.5 * gap_rad} {0.5 * gap_rad}"'
    return f'<fixed name="{name}" stiffness="{stiffness}" damping="{damping}" {slack}>{joints}</fixed>'


def model_xml(bus: Bus, effect: str, sizes: Sizes, solver: Solver = SOLVERS[0]) -> str:
    """Return the model as the engine reads it."""
    at_motor, at_load = (sizes.get("dry_nm", 0.0) * (effect == f"coulomb_friction_{at}") for at in ("motor", "load"))
    if effect == "brake_drag":
        at_load = NO_FRICTION_NM
    bodies = [_body("motor", bus.J_M, bus.b_M, at_motor), _body("load", bus.J_L, bus.b_L, at_load)]
    ends, tendons = ("motor", "load"), []
    if effect == "extra_torsional_mode":
        bodies.append(_body("extra", sizes["inertia"]))
        ends = ("extra", "load") if sizes["at_motor"] else ("motor", "extra")
        link = ("motor", "extra") if sizes["at_motor"] else ("extra", "load")
        tendons.append(_tendon("link", link, sizes["stiffness"], 0.02 * (sizes["stiffness"] * sizes["inertia"]) ** 0.5))
    tendons.append(_tendon("shaft", ends, bus.k, bus.c, sizes.get("gap_rad", 0.0)))
    equality = ""
    if effect == "generator_coupled":
        bodies.append(_body("generator", sizes["inertia"], damping=0.01))
        equality = '<equality><joint name="clutch" joint1="generator" joint2="motor" active="false"/></equality>'
    limit = f'forcelimited="true" forcerange="{-sizes["limit_nm"]} {sizes["limit_nm"]}"' if "limit_nm" in sizes else ""
    lag = f'dyntype="filterexact" dynprm="{sizes["lag_s"]}"' if "lag_s" in sizes else ""
    return (
        f'<mujoco><option timestep="{solver.step_s}" gravity="0 0 0" integrator="{solver.method}">'
        '<flag contact="disable"/></option>'
        f"<worldbody>{''.join(bodies)}</worldbody><tendon>{''.join(tendons)}</tendon>{equality}"
        f'<actuator><general name="inverters" joint="motor" gainprm="1" {lag} {limit}/></actuator></mujoco>'
    )


def _drive(
    bus: Bus, effect: str, sizes: Sizes, start_rad_s: float, torque_nm: FloatArray, solver: Solver = SOLVERS[0]
) -> FloatArray:
    """Return the motor's speed at the begin of each period, shape (N,)."""
    import mujoco  # a dependency of development: only here

    model = mujoco.MjModel.from_xml_string(model_xml(bus, effect, sizes, solver))
    data = mujoco.MjData(model)
    motor, load = (model.joint(name).dofadr[0] for name in ("motor", "load"))
    data.qvel[:] = start_rad_s
    if data.act.size:
        data.act[0] = torque_nm[0]
    speeds, steps = np.empty(torque_nm.size), round(PERIOD_S / solver.step_s)
    for row, wanted_nm in enumerate(torque_nm):
        speeds[row] = data.qvel[motor]
        _change(model, data, bus, effect, sizes, PERIOD_S * row - SETTLING_S, int(load))
        data.ctrl[0] = wanted_nm
        against = bus.load_torque_nm + sizes.get("drag", 0.0) * data.qvel[load] * abs(data.qvel[load])
        if effect == "load_imbalance":
            against += sizes["imbalance_nm"] * np.sin(data.qpos[load] / bus.gear_ratio)
        data.qfrc_applied[load] = -against
        mujoco.mj_step(model, data, steps)
    return speeds


def _change(model: Any, data: Any, bus: Bus, effect: str, sizes: Sizes, time_s: float, load: int) -> None:
    """Change what an event changes, between two periods."""
    on = sizes.get("from_s", 0.0) <= time_s < sizes.get("to_s", 0.0)
    if effect == "brake_drag":
        model.dof_frictionloss[load] = sizes["brake_nm"] if on else NO_FRICTION_NM
    elif effect == "generator_coupled":
        if not data.eq_active[0]:  # its own control keeps it near the motor's speed; its angle is nobody's
            data.joint("generator").qpos[0] = data.joint("motor").qpos[0]
            data.joint("generator").qvel[0] = GENERATOR_BEHIND * data.joint("motor").qvel[0]
        data.eq_active[0] = on
    elif effect == "stiffness_change":
        model.tendon_stiffness[0] = bus.k * (1.0 + sizes["step"] * on)
    elif effect == "inertia_change" and time_s >= sizes["at_s"]:
        model.body_inertia[model.body("load").id] = bus.J_L * (1.0 + sizes["share"])
        model.dof_M0[load] = bus.J_L * (1.0 + sizes["share"])  # of a body on one hinge the engine takes this one
