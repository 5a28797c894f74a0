"""What a campaign can plant: groups of kinds, each with the effects it hides."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

from hil.errors import UsageError
from hil.proof.truth.bus import NOMINAL_ERROR
from hil.proof.truth.specimen import EFFECTS, PAIR_SIGN, find


class Group(Enum):
    """What the right verdict is the same for."""

    SINGLE = "single"
    PAIR = "pairs"
    NONE = "none"
    OFF = "off"
    OUTSIDE = "outside"


NOTHING = "none"

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


@dataclass(frozen=True, slots=True)
class Kind:
    """One row of a campaign.

    Attributes
    ----------
    name : str
        ``none``, ``off``, an effect, or a pair.
    group : Group
    effect : str
        What is hidden, as the truth simulator calls it.
    nominal_error : float
        Share by which the nominal values are off at most.
    """

    name: str
    group: Group
    effect: str
    nominal_error: float = NOMINAL_ERROR


def _singles(catalogued: bool) -> list[str]:
    return [name for name, effect in EFFECTS.items() if effect.catalogued is catalogued and name != NOTHING]


def kind(name: str) -> Kind:
    """Return the kind of a name.

    Raises
    ------
    UsageError
        If an effect in it is not registered.
    """
    if name == NOTHING:
        return Kind(NOTHING, Group.NONE, NOTHING, nominal_error=0.0)
    if name == OFF:
        return Kind(OFF, Group.OFF, NOTHING)
    effects = find(name)
    if not all(effect.catalogued for effect in effects):
        return Kind(name, Group.OUTSIDE, name)
    return Kind(name, Group.PAIR if PAIR_SIGN in name else Group.SINGLE, name)


_NAMES = {
    Group.SINGLE.value: tuple(_singles(catalogued=True)),
    Group.PAIR.value: PAIRS,
    Group.OUTSIDE.value: tuple(_singles(catalogued=False)),
}
"""Names of the groups that have several kinds; ``none`` and ``off`` are kinds themselves."""

ALL = "all"


def parse_kinds(text: str) -> list[Kind]:
    """Return the kinds of a list of groups and names joined by commas, each once, in the order given.

    Raises
    ------
    UsageError
        If a name is neither a group nor an effect.
    """
    names: list[str] = []
    for word in text.split(","):
        names += _expanded(word.strip())
    return [kind(name) for name in dict.fromkeys(names)]


def _expanded(word: str) -> Sequence[str]:
    if word == ALL:
        return (NOTHING, OFF, *(name for names in _NAMES.values() for name in names))
    return _NAMES.get(word, (word,))


def parse_seeds(text: str) -> range:
    """Return the seeds of ``A..B``, both included, or of a single number.

    Raises
    ------
    UsageError
        If it is neither, or B is less than A.
    """
    first, sign, last = text.partition("..")
    try:
        seeds = range(int(first), int(last if sign else first) + 1)
    except ValueError:
        raise UsageError(f"seeds: expected A..B or one number, such as 1..20, got {text!r}") from None
    if not seeds or seeds[0] < 0:
        raise UsageError(f"seeds: expected A..B with 0 <= A <= B, got {text!r}")
    return seeds
