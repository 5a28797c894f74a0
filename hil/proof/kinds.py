"""What a sealed case hides: groups of kinds, each with its effects, and the draw of a set."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np

from hil.proof.truth.bus import NOMINAL_ERROR
from hil.proof.truth.specimen import EFFECTS, NOTHING, PAIR_SIGN, find

OFF = "off"

PAIRS = (
    "backlash+coulomb_friction_motor",
    "backlash+actuator_lag",
    "backlash+road_grade",
    "backlash+cardan_second_order",
    "backlash+stale_samples",
    "stiffness_nonlinearity+transport_delay",
    "stiffness_nonlinearity+resolver_error",
    "stiffness_change+coulomb_friction_motor",
    "shaft_hysteresis+aerodynamic_drag",
    "extra_torsional_mode+road_grade",
    "coulomb_friction_motor+aerodynamic_drag",
    "stribeck_friction+road_grade",
    "torque_ripple+coulomb_friction_motor",
    "generator_coupled+aerodynamic_drag",
    "inverter_gain_mismatch+backlash",
    "torque_derating+stiffness_nonlinearity",
    "torque_saturation+coulomb_friction_load",
    "brake_drag+backlash",
    "tyre_slip+road_grade",
    "load_imbalance+coulomb_friction_load",
    "inertia_change+transport_delay",
    "warming_friction+backlash",
    "speed_filter+stribeck_friction",
    "speed_quantisation+backlash",
    "lost_samples+stiffness_nonlinearity",
    "clock_drift+coulomb_friction_motor",
    "eddy_drag+backlash",
    "viscoelastic_shaft+road_grade",
    "asymmetric_friction+transport_delay",
    "gear_losses+resolver_error",
    "torque_nonlinearity+backlash",
    "torque_bias+stiffness_nonlinearity",
)
"""Pairs that meet on real vehicles: wear with wear, wear with road or load, mechanics with a fault of the chain that
records it. Left out are those that no recording of torque and speed tells from one of them alone."""

SEEDS = 2**31  # seeds of cases


class Group(Enum):
    """What the right verdict is the same for."""

    SINGLE = "single"
    PAIR = "pairs"
    NONE = "none"
    OFF = "off"
    OUTSIDE = "outside"


@dataclass(frozen=True, slots=True)
class CaseKind:
    """One row of a campaign."""

    name: str  # ``none``, ``off``, an effect, or a pair
    group: Group  # that its cases are counted in
    effect: str  # what is hidden, as the truth simulator calls it
    nominal_error: float = NOMINAL_ERROR  # share by which the nominal values are off at most


def _singles(catalogued: bool) -> list[str]:
    return [name for name, effect in EFFECTS.items() if effect.catalogued is catalogued and name != NOTHING]


def kind(name: str) -> CaseKind:
    """Return the kind of a name; `UsageError` where the name, or a part of it, is of no effect."""
    if name == NOTHING:
        return CaseKind(NOTHING, Group.NONE, NOTHING, nominal_error=0.0)
    if name == OFF:
        return CaseKind(OFF, Group.OFF, NOTHING)
    effects = find(name)
    if not all(effect.catalogued for effect in effects):
        return CaseKind(name, Group.OUTSIDE, name)
    return CaseKind(name, Group.PAIR if PAIR_SIGN in name else Group.SINGLE, name)


SHARES = {Group.SINGLE: 0.5, Group.PAIR: 0.2, Group.OUTSIDE: 0.15, Group.OFF: 0.1, Group.NONE: 0.05}
"""How often each group is drawn: one effect of the catalogue in every second case."""


NAMES = {
    Group.SINGLE: tuple(_singles(catalogued=True)),
    Group.PAIR: PAIRS,
    Group.OUTSIDE: tuple(_singles(catalogued=False)),
    Group.OFF: (OFF,),
    Group.NONE: (NOTHING,),
}


@dataclass(frozen=True, slots=True)
class Drawn:
    """What one case hides, and what its bus and sizes are drawn from."""

    name: str  # case_001 and on
    kind: CaseKind  # what is hidden
    seed: int  # of bus, sizes and recordings


def draw(cases: int, seed: int) -> list[Drawn]:
    """Draw what each of so many cases hides; equal seeds give equal draws, and the first of more are those of fewer."""
    return [_draw(number, np.random.default_rng([seed, number])) for number in range(1, cases + 1)]


def _draw(number: int, rng: np.random.Generator) -> Drawn:
    group = list(SHARES)[int(rng.choice(len(SHARES), p=list(SHARES.values())))]
    hidden = NAMES[group][int(rng.integers(len(NAMES[group])))]
    return Drawn(f"case_{number:03d}", kind(hidden), int(rng.integers(SEEDS)))
