"""What a fit missed because its law was written one way is found where it is written another."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.hypotheses import NOTHING
from estimator.physics.catalogue import EFFECTS
from estimator.physics.steps import moments_of
from tests.estimator.diagnosis.one_effect import DRIVES, SHAKES, bench_with
from tests.estimator.diagnosis.planted import SIGMA
from tests.estimator.physics.bench import TWO_MASS


def test_a_mode_near_half_the_sampling_rate_is_told_between_motor_and_shaft() -> None:
    """A branch beside the line comes near, but with a damping and an inertia that no mode has."""
    name, values = "extra_torsional_mode", {"between_kg_m2": 0.2, "line_share": 0.7, "damping_ratio": 0.02}
    bench, effects = bench_with(name, values, SHAKES), frozenset({name})
    beside = bench.fit(effects, bench.fit(NOTHING))
    found = bench.fit_retold(effects, name)
    assert bench.fit_retold(effects, name) is found is bench.fit(effects)
    assert found.rms == pytest.approx(SIGMA, rel=0.05)
    assert found.squares < beside.squares
    for key in ("between_kg_m2", "line_share"):  # so little damping is hardly seen
        assert found.value(name, key) == pytest.approx(values[key], rel=0.1)
    true_hz = np.sqrt(TWO_MASS["k"] * 0.7 / 0.3 / 0.2) / (2.0 * np.pi)
    fitted = {key: found.value(name, key) for key in values}
    assert EFFECTS[name].derived(fitted, {"k": found.value("", "k")})["frequency_hz"] == pytest.approx(
        true_hz, rel=0.05
    )


@pytest.mark.parametrize("presliding_rad", [0.0, 2e-3])
def test_friction_bends_before_it_slides_where_that_is_seen(presliding_rad: float) -> None:
    name, values = "stribeck_friction", {"excess_nm": 18.0, "coulomb_nm": 10.0, "stribeck_rad_s": 1.5}
    bench, effects = bench_with(name, values | {"presliding_rad": presliding_rad}), frozenset({name})
    rigid = bench.fit(effects, bench.fit(NOTHING))
    found = bench.fit_retold(effects, name)
    if presliding_rad == 0.0:
        assert found is rigid
        return
    assert rigid.rms > 1.2 * SIGMA
    assert found.rms == pytest.approx(SIGMA, rel=0.05)
    for key in values:
        assert found.value(name, key) == pytest.approx(values[key], rel=0.05)
    assert found.value(name, "presliding_rad") == pytest.approx(presliding_rad, rel=0.1)


@pytest.mark.parametrize("presliding_rad", [0.0, 1e-5, 1e-3])
def test_a_brake_sticks_where_that_is_seen(presliding_rad: float) -> None:
    """Told another way it keeps the moments that were found."""
    name, own = "brake_drag", {"from_s": 3.0, "to_s": 12.0}
    bench = bench_with(name, {"brake_nm": 25.0, "presliding_rad": presliding_rad} | own)
    effects = frozenset({name})
    rounded = bench.fit(effects, bench.fit(NOTHING))
    found = bench.fit_retold(effects, name)
    assert found.rms == pytest.approx(SIGMA, rel=0.05)
    assert found.value(name, "brake_nm") == pytest.approx(25.0, rel=0.02)
    if presliding_rad == 0.0:
        return
    assert rounded.rms > 1.1 * SIGMA
    for from_s, to_s in moments_of(found, name):
        assert (from_s, to_s) == pytest.approx((own["from_s"], own["to_s"]), abs=0.05)
    if presliding_rad == 1e-3:
        assert found.value(name, "presliding_rad") == pytest.approx(presliding_rad, rel=0.2)


@pytest.mark.parametrize("share", [0.25, -0.2])
def test_a_shaft_of_two_stages_is_told_as_one(share: float) -> None:
    name, stages = "stiffness_nonlinearity", {"hardening_per_rad2": 0.0, "stage_share": share, "stage_rad": 0.03}
    bench, effects = bench_with(name, stages), frozenset({name})
    smooth = bench.fit(effects, bench.fit(NOTHING))
    found = bench.fit_retold(effects, name)
    assert smooth.rms > 1.2 * SIGMA
    assert found.rms == pytest.approx(SIGMA, rel=0.05)
    assert found.value(name, "hardening_per_rad2") == 0.0
    for key in ("stage_share", "stage_rad"):
        assert found.value(name, key) == pytest.approx(stages[key], rel=0.05)


@pytest.mark.parametrize("heating_nm", [0.0, 90.0])
def test_a_torque_derates_by_its_own_heat_where_that_is_seen(heating_nm: float) -> None:
    """Two recordings of other torques lose other shares of them."""
    name, values = "torque_derating", {"depth": 0.2, "time_constant_s": 6.0, "heating_nm": heating_nm}
    bench, effects = bench_with(name, values, (DRIVES[0], 0.5 * DRIVES[1])), frozenset({name})
    by_time = bench.fit(effects, bench.fit(NOTHING))
    found = bench.fit_retold(effects, name)
    assert found.rms == pytest.approx(SIGMA, rel=0.05)
    if heating_nm == 0.0:
        assert found is by_time
        return
    assert by_time.rms > 1.2 * SIGMA
    told = found.values_of(name)
    assert told["time_constant_s"] == pytest.approx(6.0, rel=0.1)
    assert told["depth"] / told["heating_nm"] ** 2 == pytest.approx(0.2 / heating_nm**2, rel=0.05)


@pytest.mark.parametrize("exact", sorted(TWO_MASS))
def test_a_law_is_told_another_way_beside_a_parameter_that_is_trusted_exactly(exact: str) -> None:
    """A fit without it among its unknowns still has its value."""
    name = "extra_torsional_mode"
    bench, effects = (
        bench_with(name, {"between_kg_m2": 0.2, "line_share": 0.7, "damping_ratio": 0.02}, SHAKES),
        frozenset({name}),
    )
    parameters = dict(bench.model.parameters)
    parameters[exact] = replace(parameters[exact], tolerance=0.0)
    held = replace(bench, model=replace(bench.model, parameters=parameters))
    beside = held.fit(effects, held.fit(NOTHING))
    assert held.fit_retold(effects, name).squares <= beside.squares
