"""What each effect does to a recording of the bus, as arrays: the numbers behind the pictures of docs/catalogue.md.

The size of an effect is chosen to be seen, not to be typical. "Without" is the model without the effect, in free run
from the recorded torque; only load torque and initial state are taken from the recording, as ``hil compare`` does it.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from estimator.physics.catalogue import EFFECTS
from estimator.physics.driveline import InitialCondition
from estimator.physics.effect import Place
from estimator.physics.free_run import free_run
from estimator.physics.layout import Grid, flat_values, grid_for
from estimator.physics.simulate import simulate
from estimator.signals.record import FloatArray, Record
from tests.docs.bus import BUS, DRIVES, LINE, LOAD_NM, PERIOD_S, TIME_S, Drive, Values
from tests.docs.law_curves import (
    FAST,
    SPEEDS,
    TORQUES,
    Curve,
    drag,
    during,
    fading,
    friction,
    hysteresis,
    lagging,
    late,
    over_time,
    over_turn,
    reading,
    response,
    shaft,
    slip,
    step_answer,
    torque,
)


@dataclass(frozen=True, slots=True)
class Shown:
    """What is planted for a picture, in which test, and the law's own curve."""

    values: Values
    drive: str
    curve: Callable[[Values], Curve]


@dataclass(frozen=True, slots=True)
class Signature:
    """Speed as recorded with an effect and as the model without it predicts it, shape (N,) [rad/s]."""

    time_s: FloatArray
    recorded: FloatArray
    without: FloatArray
    curve: Curve


def signature(name: str) -> Signature:
    """Simulate what an effect leaves in a recording."""
    shown = SHOWN[name]
    clean, start = _driven(DRIVES[shown.drive])
    recorded = _recorded(name, shown.values, clean, start)
    okay = np.isfinite(recorded)
    rec = replace(clean, output=np.where(okay, recorded, 0.0), okay=okay)
    return Signature(TIME_S, recorded, free_run(LINE, rec).output, shown.curve(shown.values))


def _driven(drive: Drive) -> tuple[Record, InitialCondition]:
    """Return the recording of a test without any effect, and its start."""
    start = InitialCondition(LOAD_NM, 0.0, drive.speed_rad_s, drive.torque_nm[0].sum() / BUS["k"], drive.speed_rad_s)
    rec = Record("run", PERIOD_S, TIME_S, drive.torque_nm, np.ones(TIME_S.size), np.ones(TIME_S.size, dtype=bool))
    return replace(rec, output=_simulated({}, rec, start)), start


def _simulated(
    effects: Mapping[str, Values], rec: Record, start: InitialCondition, load: FloatArray | None = None
) -> FloatArray:
    grid = Grid(LINE.structure, grid_for(LINE, [rec]).substeps, 0.2)
    return simulate(grid, rec, flat_values(BUS, effects), start, load)


def _recorded(name: str, values: Values, rec: Record, start: InitialCondition) -> FloatArray:
    """Return the speed as it would be recorded; what arises behind the simulation is put on top of it."""
    rng = np.random.default_rng(3)
    clean = rec.output
    if name == "road_grade":
        return _simulated({}, rec, start, _road(values))
    if name == "stale_samples":
        rows = np.arange(TIME_S.size)
        rows[rng.random(TIME_S.size) < values["share"]] = 0
        return clean[np.maximum.accumulate(rows)]
    if name == "lost_samples":
        return np.where(rng.random(TIME_S.size) < values["share"], np.nan, clean)
    if name == "sample_jitter":
        return _simulated({}, replace(rec, offset_s=values["jitter_s"] * rng.standard_normal(TIME_S.size)), start)
    return _simulated({name: values}, rec, start)


def _road(values: Values) -> FloatArray:
    wave = np.sin(2.0 * np.pi * TIME_S / 6.0) + 0.5 * np.sin(2.0 * np.pi * TIME_S / 2.7 + 1.0)
    return values["grade_rms_nm"] * wave / np.sqrt(np.mean(wave**2))


def _samples(name: str) -> Callable[[Values], Curve]:
    """Draw a few samples as they should be and as they are recorded."""

    def curve(values: Values) -> Curve:
        clean, start = _driven(DRIVES["cruise"])
        read = _recorded(name, values, clean, start)
        rows = slice(100, 140)
        lines = (("without", TIME_S[rows], clean.output[rows]), ("with", TIME_S[rows], read[rows]))
        return Curve("time [s]", "speed [rad/s]", lines)

    return curve


EVENT = {"from_s": 2.0, "to_s": 4.5}
SHOWN: dict[str, Shown] = {
    "inverter_gain_mismatch": Shown({"gain_m1": 0.85}, "tip", torque("inverter_gain_mismatch")),
    "torque_derating": Shown(
        {"depth": 0.25, "time_constant_s": 3.0},
        "tip",
        over_time("true torque by reading", 1.0, lambda v: 1.0 - v["depth"] * (1.0 - fading(v))),
    ),
    "torque_saturation": Shown({"limit_sum_nm": 280.0}, "tip", torque("torque_saturation")),
    "actuator_lag": Shown({"time_constant_s": 0.02}, "cruise", step_answer("torque after a step", lagging)),
    "transport_delay": Shown({"delay_s": 0.025}, "cruise", step_answer("torque after a step", late)),
    "torque_ripple": Shown(
        {"amplitude_nm": 25.0, "order": 6.0},
        "reversal",
        over_turn("torque [Nm]", lambda v, phi: v["amplitude_nm"] * np.cos(v["order"] * phi)),
    ),
    "coulomb_friction_motor": Shown({"friction_nm": 40.0}, "reversal", friction("coulomb_friction_motor")),
    "stribeck_friction": Shown(
        {"excess_nm": 40.0, "coulomb_nm": 25.0, "stribeck_rad_s": 1.5}, "reversal", friction("stribeck_friction")
    ),
    "quadratic_friction": Shown({"quadratic_nm_s2": 0.25}, "reversal", friction("quadratic_friction")),
    "generator_coupled": Shown(
        EVENT | {"inertia_kg_m2": 0.8},
        "cruise",
        over_time("motor inertia [kg m²]", BUS["J_M"], lambda v: BUS["J_M"] + v["inertia_kg_m2"] * during(v)),
    ),
    "backlash": Shown({"gap_rad": 0.04, "contact_rad": 1e-3}, "tip", shaft("backlash")),
    "stiffness_nonlinearity": Shown(
        {"hardening_per_rad2": 150.0, "shape": 1.0}, "tip", shaft("stiffness_nonlinearity")
    ),
    "stiffness_change": Shown(
        EVENT | {"change": -0.25},
        "cruise",
        over_time("stiffness [Nm/rad]", BUS["k"], lambda v: BUS["k"] * (1.0 + v["change"] * during(v))),
    ),
    "shaft_hysteresis": Shown({"friction_nm": 40.0, "yield_rad": 4e-3}, "tip", hysteresis),
    "cardan_second_order": Shown(
        {"amplitude_nm": 25.0},
        "reversal",
        over_turn("torque in the shaft [Nm]", lambda v, phi: v["amplitude_nm"] * np.cos(2.0 * phi)),
    ),
    "extra_torsional_mode": Shown(
        {"inertia_kg_m2": 0.3, "frequency_hz": 14.0, "damping_ratio": 0.04}, "cruise", response
    ),
    "coulomb_friction_load": Shown({"friction_nm": 40.0}, "reversal", drag("coulomb_friction_load", SPEEDS)),
    "aerodynamic_drag": Shown({"drag_nm_s2": 0.3}, "tip", drag("aerodynamic_drag", FAST)),
    "road_grade": Shown(
        {"grade_rms_nm": 60.0}, "cruise", over_time("load torque [Nm]", LOAD_NM, lambda v: LOAD_NM + _road(v))
    ),
    "brake_drag": Shown(
        EVENT | {"brake_nm": 60.0}, "cruise", over_time("braking torque [Nm]", 0.0, lambda v: v["brake_nm"] * during(v))
    ),
    "tyre_slip": Shown({"slip_per_nm": 1e-4, "wheel_share": 0.06, "creep_rad_s": 2.0}, "tip", slip),
    "load_imbalance": Shown(
        {"amplitude_nm": 120.0, "motor_turns_per_turn": 5.6},
        "cruise",
        over_turn("load torque [Nm]", lambda v, phi: v["amplitude_nm"] * np.cos(phi / v["motor_turns_per_turn"]), 11.2),
    ),
    "inertia_change": Shown(
        EVENT | {"change_kg_m2": 25.0},
        "tip",
        over_time("load inertia [kg m²]", BUS["J_L"], lambda v: BUS["J_L"] + v["change_kg_m2"] * during(v)),
    ),
    "warming_friction": Shown(
        {"cold_nm_s": 2.0, "time_constant_s": 3.0},
        "cruise",
        over_time("friction [Nm s/rad]", BUS["b_L"], lambda v: BUS["b_L"] + v["cold_nm_s"] * fading(v)),
    ),
    "resolver_error": Shown(
        {"once_rad": 0.03, "twice_rad": 0.02},
        "reversal",
        over_turn(
            "angle error [mrad]",
            lambda v, phi: 1e3 * (v["once_rad"] * np.sin(phi) + v["twice_rad"] * np.sin(2.0 * phi)),
        ),
    ),
    "speed_filter": Shown({"time_constant_s": 0.02}, "cruise", step_answer("reading after a step", lagging)),
    "speed_sign_blind": Shown({"share": 1.0}, "reversal", reading("speed_sign_blind")),
    "speed_quantisation": Shown({"step_rad_s": 0.5}, "cruise", reading("speed_quantisation")),
    "stale_samples": Shown({"share": 0.3}, "cruise", _samples("stale_samples")),
    "lost_samples": Shown({"share": 0.15}, "cruise", _samples("lost_samples")),
    "sample_jitter": Shown({"jitter_s": 2e-3}, "cruise", _samples("sample_jitter")),
    "clock_drift": Shown(
        {"rate": 5e-3}, "cruise", over_time("torque's clock ahead [ms]", 0.0, lambda v: 1e3 * v["rate"] * TIME_S)
    ),
}
"""Per effect: its size, the test that shows it, its law."""

DRAWN: dict[Place, Callable[[str], Callable[[Values], Curve]]] = {
    Place.MOTOR: friction,
    Place.LOAD: lambda name: drag(name, SPEEDS),
    Place.TORQUE: torque,
}
"""How the law of an entry is drawn by its place, where nothing else is said."""

SHOWN |= {
    "torque_bias": Shown(
        {"offset_nm": 25.0, "time_constant_s": 2.0},
        "cruise",
        over_time("true torque less its reading [Nm]", 0.0, lambda v: v["offset_nm"] * (1.0 - fading(v))),
    ),
    "viscoelastic_shaft": Shown(
        {"branch_share": 0.4, "relaxation_s": 0.02},
        "cruise",
        step_answer(
            "torque by stiffness after a twist",
            lambda t, v: np.where(
                t >= 0.0, 1.0 + v["branch_share"] * np.exp(-np.maximum(t, 0.0) / v["relaxation_s"]), 0.0
            ),
        ),
    ),
    "gear_losses": Shown(
        {"driving_share": 0.1, "back_share": 0.06},
        "reversal",
        lambda v: Curve(
            "torque of the shaft [Nm]",
            "torque at the load, forward [Nm]",
            (("without", TORQUES, TORQUES), ("with", TORQUES, TORQUES - np.abs(TORQUES) * _losses(v))),
        ),
    ),
    "gravity": Shown(
        {"moment_nm": 60.0, "motor_turns_per_turn": 20.0},
        "reversal",
        over_turn(
            "torque at the load [Nm]", lambda v, phi: v["moment_nm"] * np.sin(phi / v["motor_turns_per_turn"]), 20.0
        ),
    ),
    "grounded_spring": Shown(
        {"stiffness_nm_per_rad": 10.0},
        "reversal",
        over_turn("torque at the load [Nm]", lambda v, phi: v["stiffness_nm_per_rad"] * phi),
    ),
}
SHOWN |= {
    name: Shown(entry.example, "reversal", DRAWN[entry.acting.place](name))
    for name, entry in EFFECTS.items()
    if name not in SHOWN and entry.acting is not None and entry.acting.place in DRAWN
}


def _losses(values: Values) -> FloatArray:
    return np.where(TORQUES > 0.0, values["driving_share"], values["back_share"])
