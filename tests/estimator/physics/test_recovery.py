"""Every effect of the catalogue that is fitted is found again at the size it was planted with, from a start nearby.

The interval is the noise's own: planted values lie within 4.5 standard errors of the fitted ones.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from estimator.physics.catalogue import EFFECTS
from estimator.physics.driveline import InitialCondition
from estimator.physics.fit import FitResult, fit
from estimator.physics.layout import Grid, flat_values, grid_for
from estimator.physics.model import Parameter
from estimator.physics.problem import make_problem, start_vector
from estimator.physics.simulate import simulate
from estimator.physics.unknowns import Release, Shared, effect_unknowns, nominal_unknowns
from estimator.signals.record import FloatArray, Record
from tests.estimator.physics.bench import TWO_MASS, model, random_steps, record, scaled

SIGMA = 0.02
SAMPLES = 1500
TRUE = scaled(TWO_MASS, J_M=1.05, J_L=0.95, k=1.04, c=0.9, b_L=0.95)
LINE = model(TWO_MASS)
GEARED = replace(
    LINE,
    gear_ratio=3.0,
    parameters={**LINE.parameters, "b_M": Parameter(TRUE["b_M"], 0.0)},  # speed alone hardly tells b_M from b_L
)


@dataclass(frozen=True, slots=True)
class Plant:
    """What is planted: shared values, each recording's own, and how far off the fit starts.

    ``undetermined`` are parameters of which the recordings determine only what they are together.
    """

    shared: Mapping[str, float]
    own: tuple[Mapping[str, float], Mapping[str, float]] = field(default_factory=lambda: ({}, {}))
    factor: float = 1.1
    off: float = 0.02
    undetermined: frozenset[str] = frozenset()


EVENTS = ({"from_s": 3.21, "to_s": 8.4}, {"from_s": 5.5, "to_s": 11.03})
OVERTONE = {"overtone_in_step": 0.12, "overtone_across": -0.15}
PHASES = ({"phase_rad": 0.4}, {"phase_rad": -1.1})
PLANTS = {
    "inverter_gain_mismatch": Plant({"gain_m1": 0.9}),
    "torque_derating": Plant({"depth": 0.2, "time_constant_s": 6.0}),
    "torque_saturation": Plant({"limit_m1_nm": 80.0, "limit_m2_nm": 70.0, "sharpness": 12.0}, factor=0.97),
    "actuator_lag": Plant({"time_constant_s": 0.02, "shape": 0.15}),
    "transport_delay": Plant({"delay_s": 0.023}),
    "torque_ripple": Plant({"amplitude_nm": 15.0, "order": 6.0} | OVERTONE, PHASES),
    "torque_ripple/share": Plant(
        {"share": 0.04, "order": 6.0} | OVERTONE, ({"share_phase_rad": 0.4}, {"share_phase_rad": -1.1})
    ),
    "coulomb_friction_motor": Plant({"friction_nm": 15.0}),
    "stribeck_friction": Plant({"excess_nm": 20.0, "coulomb_nm": 12.0, "stribeck_rad_s": 1.5}),
    "quadratic_friction": Plant({"quadratic_nm_s2": 0.5}),
    "generator_coupled": Plant({"inertia_kg_m2": 0.8}, EVENTS, factor=1.05, off=0.01),
    "backlash": Plant({"gap_rad": 0.02, "contact_rad": 1e-3, "pull": 0.4}),
    "stiffness_nonlinearity": Plant({"hardening_per_rad2": 250.0, "shape": 1.0}),
    "stiffness_change": Plant({"change": -0.2}, EVENTS),
    "shaft_hysteresis": Plant(
        {"friction_nm": 20.0, "yield_rad": 4e-3, "sharpness": 2.0, "unloading": 0.3, "inside": 0.4},
        undetermined=frozenset({"k", "inside"}),  # the stiffness after it has yielded
    ),
    "cardan_second_order": Plant({"amplitude_nm": 15.0}, PHASES),
    "cardan_second_order/angle": Plant({"angle_rad": 0.004}, ({"angle_phase_rad": 0.4}, {"angle_phase_rad": -1.1})),
    "cardan_second_order/share": Plant({"share": 0.1}, ({"share_phase_rad": 0.4}, {"share_phase_rad": -1.1})),
    "extra_torsional_mode": Plant(
        {"inertia_kg_m2": 0.2, "frequency_hz": 14.0, "damping_ratio": 0.05, "line_share": 0.9},
        undetermined=frozenset({"k", "c", "line_share"}),  # what the shaft and the other spring are together
    ),
    "coulomb_friction_load": Plant({"friction_nm": 15.0}),
    "aerodynamic_drag": Plant({"drag_nm_s2": 0.5}),
    "brake_drag": Plant({"brake_nm": 20.0}, EVENTS),
    "tyre_slip": Plant(
        {
            "slip_per_nm": 5e-4,
            "wheel_share": 0.1,
            "creep_rad_s": 3.0,
            "relaxation_rad": 2.0,
            "carcass_s": 0.01,
            "grip_nm": 450.0,
        }
    ),
    "load_imbalance": Plant({"amplitude_nm": 40.0, "motor_turns_per_turn": 3.0} | OVERTONE, PHASES),
    "inertia_change": Plant({"change_kg_m2": 6.0}, EVENTS),
    "warming_friction": Plant({"cold_nm_s": 3.0, "time_constant_s": 5.0}),
    "resolver_error": Plant(
        {"once_rad": 0.01, "twice_rad": 0.008},
        ({"once_phase_rad": 0.4, "twice_phase_rad": 1.0}, {"once_phase_rad": -0.9, "twice_phase_rad": 0.2}),
    ),
    "speed_filter": Plant({"time_constant_s": 0.02, "shape": 0.4}),
    "speed_sign_blind": Plant({"share": 0.6}),
    "clock_drift": Plant({"rate": 1e-3}),
}


PLANTS |= {
    name: Plant(entry.example, PHASES if entry.phases else ({}, {})) for name, entry in EFFECTS.items() if entry.example
}


def test_every_fitted_law_is_planted() -> None:
    """An entry says its own size in ``example``; give it one, or plant it here."""
    assert {effect_of(case) for case in PLANTS} == {e.name for e in EFFECTS.values() if not (e.profile or e.recognised)}


def torque_of(name: str, seed: int) -> FloatArray:
    """Steps of one size, or, where the law is one of that size, of several."""
    torque = random_steps(SAMPLES, seed=seed, size_nm=200.0, hold=25)
    if name != "torque_nonlinearity":
        return torque
    return torque * np.repeat(np.random.default_rng(seed).choice([0.3, 0.6, 1.0], SAMPLES // 25), 25)


def effect_of(case: str) -> str:
    return case.partition("/")[0]


def recordings(name: str, plant: Plant) -> list[Record]:
    """Two recordings of a line with the effect; periodic laws run on the angle of their own output."""
    records = []
    for i, start in enumerate(
        (InitialCondition(20.0, 0.0, 3.0, 0.01, 2.9), InitialCondition(-10.0, 0.0, -2.0, 0.0, -2.0))
    ):
        torque = torque_of(name, 10 + i)
        share = 0.5 + 0.1 * i
        rec = record(np.column_stack([share * torque, (1.0 - share) * torque]), np.ones(SAMPLES), name=f"run_{i}")
        p = flat_values(TRUE, {name: {**plant.shared, **plant.own[i]}})
        grid = Grid(GEARED.structure, grid_for(GEARED, [rec]).substeps, 0.1)
        for _ in range(40):
            clean = simulate(grid, rec, p, start)
            change = np.max(np.abs(clean - rec.output))
            rec = replace(rec, output=clean)
        assert change < 1e-6
        noise = SIGMA * np.random.default_rng(i).standard_normal(SAMPLES)
        records.append(replace(rec, output=rec.output + noise))
    return records


def nearby(name: str, plant: Plant, records: list[Record]) -> Release:
    """Start a little off what was planted; a discrete choice is the planted one."""
    base = min(
        effect_unknowns(name, GEARED, records), key=lambda release: sum(_held_apart(s, plant) for s in release.shared)
    )

    def moved(unknown: Shared, values: Mapping[str, float], factor: float, off: float) -> Shared:
        if unknown.low == unknown.high or unknown.name not in values:
            return unknown
        return replace(unknown, start=(values[unknown.name] * factor + off) / unknown.scale)

    return Release(
        tuple(moved(s, plant.shared, plant.factor, 0.0) for s in base.shared),
        tuple(
            tuple(moved(s, own, 1.0, plant.off) for s in each) for each, own in zip(base.own, plant.own, strict=True)
        ),
    )


def _held_apart(unknown: Shared, plant: Plant) -> bool:
    """Tell whether a start holds what was planted otherwise, or leaves free what was not planted."""
    if unknown.low == unknown.high:
        null = {p.name: p.null for p in EFFECTS[unknown.effect].parameters}[unknown.name]
        return bool(unknown.scale * unknown.start != plant.shared.get(unknown.name, null))
    return unknown.name not in plant.shared


def fitted(name: str, plant: Plant) -> FitResult:
    records = recordings(name, plant)
    release = nearby(name, plant, records)
    grid = replace(grid_for(GEARED, records), sign_width=0.1)
    problem = make_problem(GEARED, records, (*nominal_unknowns(GEARED), *release.shared), own=release.own, grid=grid)
    assert not np.isnan(start_vector(problem)).any()
    return fit(problem)


def standard_errors(result: FitResult) -> FloatArray:
    """Standard errors of the scaled unknowns; 0 where one is held."""
    free = ~result.pinned & result.jacobian.any(axis=0)  # the phase of an amplitude that is none changes nothing
    errors = np.zeros(result.x.size)
    jacobian = result.jacobian[:, free]
    errors[free] = SIGMA * np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian)))
    return errors


@pytest.mark.parametrize("case", PLANTS)
def test_the_fit_finds_what_was_planted(case: str) -> None:
    name, plant = effect_of(case), PLANTS[case]
    result = fitted(name, plant)
    assert result.rms == pytest.approx(SIGMA, rel=0.06)  # 3000 samples: 1.3 % standard error
    errors = standard_errors(result)
    wanted = {("", key): value for key, value in TRUE.items()} | {(name, k): v for k, v in plant.shared.items()}
    for i, unknown in enumerate(result.problem.shared):
        if unknown.low == unknown.high or unknown.name in plant.undetermined:
            continue
        found, sigma = result.x[i] * unknown.scale, errors[i] * unknown.scale
        assert abs(found - wanted[unknown.effect, unknown.name]) < 4.5 * sigma + 1e-9, unknown.name
    decisive = next(i for i, s in enumerate(result.problem.shared) if s.effect == name and s.low < s.high)
    null = next(p.null for p in EFFECTS[name].parameters if p.name == result.problem.shared[decisive].name)
    if np.isfinite(null):
        assert abs(result.x[decisive] - null / result.problem.shared[decisive].scale) > 4.5 * errors[decisive]
    for index, own in enumerate(plant.own):
        basis, x = result.problem.local[index], result.local_of(index)
        for unknown, value in zip(basis.own, x[basis.own_rows], strict=True):
            if unknown.name in own:
                assert value == pytest.approx(own[unknown.name], abs=0.15)


def test_of_a_slider_within_the_stiffness_what_it_leaves_is_found() -> None:
    plant = PLANTS["shaft_hysteresis"]
    result = fitted("shaft_hysteresis", plant)
    slider, inside, over = (result.value("shaft_hysteresis", name) for name in ("friction_nm", "inside", "yield_rad"))
    true = TRUE["k"] - plant.shared["inside"] * plant.shared["friction_nm"] / plant.shared["yield_rad"]
    assert result.value("", "k") - inside * slider / over == pytest.approx(true, rel=1e-3)
