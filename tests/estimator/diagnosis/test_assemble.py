"""From a fit to the parts of a diagnosis: values with intervals and units, profiles, the augmented model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.acquisition.chain import Chain
from estimator.diagnosis.acquisition.finding import AcquisitionFinding, Sized
from estimator.diagnosis.assemble import augmented_model, moments_in, parameters_of, profiles_of, retuned_parameters
from estimator.diagnosis.covariance import reported_covariance
from estimator.diagnosis.diagnose import diagnose
from estimator.diagnosis.inference.figures import acquired_effects
from estimator.diagnosis.inference.hypotheses import NOTHING, all_good_samples
from estimator.diagnosis.result import Evidence, FoundEffect
from estimator.physics.catalogue import EFFECTS, effect_problems
from estimator.physics.driveline import InitialCondition
from estimator.physics.effect import Element
from estimator.physics.fit import FitResult
from estimator.physics.free_run import free_run
from estimator.physics.model import EffectValue, Motion
from estimator.physics.unknowns import Shared
from estimator.signals.correlation import effective_samples
from estimator.signals.record import FloatArray, Record
from tests.estimator.diagnosis.plain import Bench
from tests.estimator.diagnosis.planted import SIGMA, drive_torque, rubbing
from tests.estimator.diagnosis.regression import regression
from tests.estimator.physics.bench import ONE_MASS, linear_record, model, random_steps, scaled

COULOMB = "coulomb_friction_motor"
FRICTION_NM = 12.0
NOMINAL = scaled(ONE_MASS, J_M=1.1, b_M=0.9)
LINE = model(NOMINAL)


def hill(time_s: FloatArray) -> FloatArray:
    """Slope without a mean over the 12 s of a recording [Nm]."""
    return 25.0 * np.sin(2 * np.pi * time_s / 6.0)


def hilly() -> list[Record]:
    return [
        linear_record(
            ONE_MASS,
            drive_torque(seed, 1200),
            InitialCondition(5.0, 0.0, 2.0),
            sigma=SIGMA,
            seed=seed,
            name=f"run_{seed}",
            extra_load_nm=hill(np.arange(1200) * 0.01),
        )
        for seed in (1, 2)
    ]


def assembled(records: list[Record], *names: str) -> FitResult:
    """A fit of these effects, one after the other."""
    bench = Bench(LINE, records, all_good_samples(records))
    result = bench.fit(NOTHING)
    for count in range(1, len(names) + 1):
        result = bench.fit(frozenset(names[:count]), result)
    return result


def effect_of(name: str, result: FitResult, motion: Motion = Motion.ROTATION) -> FoundEffect:
    """The effect of a fit as a diagnosis has it; evidence plays no part here."""
    line = model(NOMINAL, motion=motion)
    parameters = parameters_of(name, result, reported_covariance(result), line)
    moments = moments_in(name, result) if EFFECTS[name].event else {}
    nothing = Evidence(0.0, 1.0, 1.0, 1.0)
    return FoundEffect(name, EFFECTS[name].element, "", parameters, moments, (), nothing)


@pytest.fixture(scope="module")
def rubbed() -> FitResult:
    return assembled(rubbing(lambda speed: FRICTION_NM), COULOMB)


@pytest.fixture(scope="module")
def friction(rubbed: FitResult) -> FoundEffect:
    return effect_of(COULOMB, rubbed)


@pytest.mark.parametrize("wrong", ["gain_m1", "gain_m2"])
def test_whichever_inverter_is_wrong_the_intervals_hold_the_line(wrong: str) -> None:
    """Only the ratio of the gains shows: the other one may be wrong, and every inertia and friction with it."""
    records, gain = [], 0.9
    for seed, share in ((1, 0.5), (2, 0.65)):
        torque, other = drive_torque(seed, 1200), random_steps(1200, seed + 20, size_nm=20.0, hold=7)
        read = np.column_stack([share * torque + other, (1.0 - share) * torque - other])
        true = read @ np.where(np.array(["gain_m1", "gain_m2"]) == wrong, gain, 1.0)
        record = linear_record(
            ONE_MASS, true, InitialCondition(5.0, 0.0, 2.0), sigma=SIGMA, seed=seed, name=f"run_{seed}"
        )
        records.append(replace(record, torque_nm=read))
    result = assembled(records, "inverter_gain_mismatch")
    found = effect_of("inverter_gain_mismatch", result)
    (named,) = found.parameters
    other_way = 1.0 / found.parameters[named].value
    assert (found.parameters[named].value if named == wrong else other_way) == pytest.approx(gain, rel=0.01)
    for name, parameter in retuned_parameters(result, reported_covariance(result), LINE, whole=True).items():
        low, high = parameter.ci95
        assert low <= ONE_MASS[name] <= high
        assert high / low >= 1.0 / gain - 0.01


class TestAnEffect:
    def test_it_has_value_interval_and_unit(self, friction: FoundEffect) -> None:
        (name,) = friction.parameters
        found = friction.parameters[name]
        assert (friction.name, friction.element, name, found.unit) == (COULOMB, Element.MOTOR, "friction_nm", "Nm")
        assert found.value == pytest.approx(FRICTION_NM, rel=0.03)
        assert found.ci95[0] < found.value < found.ci95[1]
        assert found.ci95[1] - found.ci95[0] < 0.1 * FRICTION_NM


@pytest.fixture(scope="module")
def road() -> FitResult:
    return assembled(hilly(), "road_grade")


class TestAProfile:
    def test_each_recording_has_its_own_over_time(self, road: FitResult) -> None:
        profiles = profiles_of(road, reported_covariance(road), LINE)
        assert set(profiles) == {"run_1", "run_2"}
        for profile in profiles.values():
            assert profile.unit == "Nm"
            np.testing.assert_allclose(profile.time_s, np.arange(12.0))
            assert profile.value.mean() == pytest.approx(0.0, abs=1e-9)

    def test_it_is_the_road_that_was_driven_within_its_band(self, road: FitResult) -> None:
        inside = []
        for profile in profiles_of(road, reported_covariance(road), LINE).values():
            true = hill(profile.time_s)
            assert np.max(np.abs(profile.value - true)[1:-1]) < 3.0
            inside += list((profile.low <= true) & (true <= profile.high))
        assert np.mean(inside) > 0.6  # a spline of 2 s knots follows a 6 s wave to about its noise


@pytest.fixture(scope="module")
def brake() -> FoundEffect:
    """Recordings whose clock does not start at zero, two with a brake for a while and one without."""
    time_s, records = np.arange(1200) * 0.01, []
    for seed, (name, (begin, end)) in enumerate(BRAKED_S.items(), start=1):
        load = np.where((time_s >= begin) & (time_s < end), FRICTION_NM, 0.0)
        torque, start = random_steps(1200, seed, mean_nm=90.0), InitialCondition(5.0, 0.0, 20.0)
        rec = linear_record(ONE_MASS, torque, start, sigma=SIGMA, seed=seed, name=name, extra_load_nm=load)
        records.append(replace(rec, time_s=rec.time_s + 100.0))
    return next(each for each in diagnose(records, LINE).effects if each.name == "brake_drag")


BRAKED_S = {"run_1": (2.0, 5.0), "run_2": (6.0, 9.5), "run_3": (0.0, 0.0)}


class TestAnEvent:
    def test_its_moments_are_on_each_recordings_own_time(self, brake: FoundEffect) -> None:
        for name in ("run_1", "run_2"):
            ((begin, end),) = brake.time_s[name]
            assert (begin - 100.0, end - 100.0) == pytest.approx(BRAKED_S[name], abs=0.05)


class TestAcquired:
    """What was recognised of the acquisition, as effects: a share of 0.1, errors of 1 before and 0.1 after."""

    RNG = np.random.default_rng(1)
    BEFORE = (RNG.standard_normal(1000), RNG.standard_normal(500))
    FOUND = AcquisitionFinding("stale_samples", {"share": Sized(0.1, (0.09, 0.11), "")}, {}, 1e-12, "a tenth is stale")

    @pytest.fixture
    def acquired(self) -> FoundEffect:
        chain = Chain((), (), (self.FOUND,))
        (effect,) = acquired_effects(chain.findings, self.BEFORE, [0.1 * error for error in self.BEFORE])
        return effect

    def test_they_are_said_as_found(self, acquired: FoundEffect) -> None:
        assert (acquired.name, acquired.element) == ("stale_samples", Element.ACQUISITION)
        assert acquired.statement == "a tenth is stale"
        assert acquired.parameters["share"].ci95 == (0.09, 0.11)
        assert acquired.evidence.p_value == 1e-12

    def test_what_compensating_them_gains_speaks_for_them(self, acquired: FoundEffect) -> None:
        n = effective_samples([0.1 * error for error in self.BEFORE])
        assert acquired.evidence.delta_bic == pytest.approx(n * np.log(100.0) - np.log(n))


class TestParameters:
    def test_before_and_after_with_interval_and_unit(self, rubbed: FitResult) -> None:
        parameters = retuned_parameters(rubbed, reported_covariance(rubbed), LINE, whole=True)
        assert list(parameters) == ["J_M", "b_M"]
        inertia = parameters["J_M"]
        assert (inertia.nominal, inertia.unit) == (NOMINAL["J_M"], "kg m^2")
        assert inertia.value == pytest.approx(ONE_MASS["J_M"], rel=0.01)
        assert inertia.ci95[0] < inertia.value < inertia.ci95[1]

    def test_without_the_whole_physics_no_interval_is_narrower_than_the_trust(
        self,
    ) -> None:
        retuned = assembled(rubbing(lambda speed: FRICTION_NM))
        cov = reported_covariance(retuned)
        by_whole = {whole: retuned_parameters(retuned, cov, LINE, whole)["J_M"] for whole in (True, False)}
        assert by_whole[False].value == by_whole[True].value
        tolerance = LINE.parameters["J_M"].tolerance
        edges = (NOMINAL["J_M"] * (1.0 - tolerance), NOMINAL["J_M"] * (1.0 + tolerance))
        assert by_whole[False].ci95 == pytest.approx(edges)


class TestAugmentedModel:
    def test_it_has_the_new_values_and_the_effect(self, rubbed: FitResult, friction: FoundEffect) -> None:
        found = augmented_model(rubbed, reported_covariance(rubbed), LINE, [friction])
        assert found.values()["J_M"] == pytest.approx(ONE_MASS["J_M"], rel=0.01)
        assert found.parameters["J_M"].tolerance == LINE.parameters["J_M"].tolerance
        estimate = friction.parameters["friction_nm"]
        assert found.effects == {COULOMB: {"friction_nm": EffectValue(estimate.value, estimate.ci95)}}

    def test_it_simulates_what_was_found(self, rubbed: FitResult, friction: FoundEffect) -> None:
        """On a recording it has not seen the error is the noise."""
        found = augmented_model(rubbed, reported_covariance(rubbed), LINE, [friction])
        (unseen,) = rubbing(lambda speed: FRICTION_NM, seeds=(9,))
        assert free_run(found, unseen).rms < 1.3 * SIGMA
        assert free_run(LINE, unseen).rms > 3.0 * SIGMA


def test_a_held_value_is_reported_at_its_null_where_a_model_file_needs_it() -> None:
    """A ripple of order 6, the null of the order: without it the augmented model could not be read."""
    result = regression([np.random.default_rng(1).standard_normal((500, 3))], [np.zeros(500)])
    shared = (
        Shared("torque_ripple", "amplitude_nm", 1.0, 0.0, 20.0, 0.5),
        Shared("torque_ripple", "share", 1.0, 0.0, 0.0, 0.0),
        Shared("torque_ripple", "order", 1.0, 6.0, 6.0, 6.0),
    )
    fitted = replace(result, problem=replace(result.problem, shared=shared), x=np.array([0.5, 0.0, 6.0]))
    found = parameters_of("torque_ripple", fitted, np.eye(3), LINE)
    assert set(found) == {"amplitude_nm", "order"}
    assert found["order"].ci95 == (6.0, 6.0)
    values = {name: EffectValue(each.value, each.ci95) for name, each in found.items()}
    assert effect_problems("torque_ripple", values, LINE.structure, LINE.laws) == []
