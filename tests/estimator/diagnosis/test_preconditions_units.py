"""Wrong units and signs are refused with the factor; nominal values that are off, and missing physics, are not."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.preconditions.inertia import as_one_body, fitted_inertia
from estimator.diagnosis.preconditions.units import BEYOND, require_plausible_units
from estimator.errors import Cure, Implausible
from estimator.physics.driveline import Start
from estimator.physics.effect import Element
from estimator.physics.layout import grid_for
from estimator.physics.model import Motion
from estimator.signals.record import FloatArray, OutputKind, Record
from tests.estimator.diagnosis.planted import Moved, recordings, rubbing
from tests.estimator.physics.bench import ONE_MASS, TWO_MASS, linear_record, model, random_steps, scaled

Change = Callable[[Record], Record]

SAMPLES = 2000


def drive(values: dict[str, float] = TWO_MASS, kind: OutputKind = OutputKind.SPEED) -> Record:
    """Twenty seconds of random steps, shared by two inverters, one of them with a part of its own."""
    torque = random_steps(SAMPLES, seed=3)
    sigma = 1e-4 if kind is OutputKind.POSITION else 0.02
    record = linear_record(values, torque, Start(10.0, 0.0, 20.0, 0.0, 20.0), sigma=sigma, kind=kind)
    own = 10.0 * np.sin(np.arange(SAMPLES) / 7.0)
    return replace(record, torque_nm=np.column_stack([0.6 * torque + own, 0.4 * torque - own]))


def output(factor: float) -> Change:
    return lambda record: replace(record, output=factor * record.output)


def torque(*factors: float) -> Change:
    return lambda record: replace(record, torque_nm=record.torque_nm * np.array(factors))


def in_ms(record: Record) -> Record:
    return replace(record, time_s=1e3 * record.time_s, sample_time_s=1e3 * record.sample_time_s)


WRONG: dict[str, tuple[Change, str]] = {
    "rpm": (output(60.0 / (2.0 * math.pi)), "is the speed in rpm, expected rad/s?"),
    "degrees": (output(180.0 / math.pi), "is the output in degrees, expected radians?"),
    "turns per second": (output(0.5 / math.pi), "is the speed in turns per second, expected rad/s?"),
    "kNm": (torque(1e-3, 1e-3), "is the torque in kNm"),
    "mNm": (torque(1e3, 1e3), "is the torque in mNm"),
    "torque turned round": (torque(-1.0, -1.0), "the speed falls where the torque rises"),
    "output turned round": (output(-1.0), "the speed falls where the torque rises"),
    "one torque turned round": (torque(1.0, -1.0), "the sign of torque input 2 turned round"),
    "ms": (in_ms, "is the sampling period 0.01 s, as read 10 s? Is time in ms"),
    "an inertia twenty times too large": (output(20.0), "is the inertia in the model file that of another vehicle"),
}


@pytest.mark.parametrize("values", [TWO_MASS, ONE_MASS], ids=["two masses", "one mass"])
@pytest.mark.parametrize("fault", WRONG)
def test_a_factor_is_refused_by_name(fault: str, values: dict[str, float]) -> None:
    change, said = WRONG[fault]
    with pytest.raises(Implausible) as refusal:
        require_plausible_units([change(drive(values))], model(values))
    assert str(refusal.value).startswith("recording run is implausible: ")
    assert said in str(refusal.value)


@pytest.mark.parametrize("direction", [1.0, -1.0], ids=["too large", "too small"])
def test_a_position_in_other_units(direction: float) -> None:
    wrong = output(1e3**direction)(drive(kind=OutputKind.POSITION))
    with pytest.raises(Implausible, match=r"is the (output in thousandths|torque in mNm)"):
        require_plausible_units([wrong], model(TWO_MASS))


def test_the_gear_ratio_is_a_known_factor() -> None:
    line = replace(model(TWO_MASS), gear_ratio=13.0)
    with pytest.raises(Implausible, match=r"is the speed that at the wheel, .* a gear ratio of about 13"):
        require_plausible_units([output(1.0 / 13.0)(drive())], line)


@pytest.mark.parametrize("values", [TWO_MASS, ONE_MASS], ids=["two masses", "one mass"])
@pytest.mark.parametrize("kind", [OutputKind.SPEED, OutputKind.POSITION])
def test_right_units_pass(values: dict[str, float], kind: OutputKind) -> None:
    require_plausible_units([drive(values, kind)], model(values))


@pytest.mark.parametrize("name", sorted(TWO_MASS))
@pytest.mark.parametrize("factor", [0.8, 1.0 / 0.8])
def test_nominal_values_that_are_off_pass(name: str, factor: float) -> None:
    require_plausible_units([drive()], model(scaled(TWO_MASS, **{name: factor})))


LAWS: dict[str, tuple[Element, Callable[[Moved], FloatArray], float]] = {
    "a shaft that hardens": (Element.SHAFT, lambda moved: moved.twist**3, 3e6),
    "play": (Element.SHAFT, lambda moved: -4200.0 * np.clip(moved.twist, -0.01, 0.01), 1.0),
    "dry friction of a third of the torque": (Element.MOTOR, lambda moved: np.sign(moved.speed), 30.0),
    "a hill": (Element.LOAD, lambda moved: np.sin(0.3 * moved.time_s), 60.0),
    "a curved reading": (Element.SPEED_SENSOR, lambda moved: moved.speed * np.abs(moved.speed), 0.005),
}


@pytest.mark.parametrize("law", LAWS)
def test_missing_physics_passes(law: str) -> None:
    assert require_plausible_units(recordings(*LAWS[law]), model(TWO_MASS)) == []


def test_friction_in_one_mass_passes() -> None:
    require_plausible_units(rubbing(lambda speed: 40.0), model(ONE_MASS))


def test_a_control_that_holds_the_speed_on_a_hill_passes() -> None:
    """The torque follows the road here: seen as one body it would be an inertia of a fraction of the true one."""
    inertia, wanted, dt = 20.0, 50.0, 0.01
    rng = np.random.default_rng(1)
    speed, torques, held = [wanted], [], 0.0
    for k in range(3000):
        error = wanted - speed[-1]
        held += 8.0 * error * dt
        torques.append(60.0 * error + held)
        hill = 50.0 * math.sin(0.4 * k * dt)
        speed.append(speed[-1] + dt / inertia * (torques[-1] - 4.0 * speed[-1] - hill))
    rec = drive(ONE_MASS)
    noisy = np.array(speed[:-1]) + 0.01 * rng.standard_normal(3000)
    closed = replace(
        rec, time_s=dt * np.arange(3000), torque_nm=np.array(torques)[:, None], output=noisy, okay=np.ones(3000, bool)
    )
    line = model(ONE_MASS)
    assert fitted_inertia(closed, line, grid_for(line, [closed])) is None
    require_plausible_units([closed], line)


@pytest.mark.parametrize(("factor", "refused"), [(0.95, False), (1.05, True)])
def test_the_tolerance_widens_what_is_plausible(factor: float, refused: bool) -> None:
    """A model trusted to a factor is taken at its word."""
    wrong = output(1.0 / (1.5 * BEYOND * factor))(drive(ONE_MASS))
    if refused:
        with pytest.raises(Implausible):
            require_plausible_units([wrong], model(ONE_MASS, 0.5))
    else:
        require_plausible_units([wrong], model(ONE_MASS, 0.5))


def test_a_force_as_output_is_not_judged() -> None:
    require_plausible_units([replace(output(1e6)(drive()), kind=OutputKind.FORCE)], model(TWO_MASS))


def test_too_short_to_tell() -> None:
    rec = drive(ONE_MASS)
    short = replace(
        rec, time_s=rec.time_s[:900], torque_nm=rec.torque_nm[:900], output=rec.output[:900], okay=rec.okay[:900]
    )
    assert as_one_body(short, model(ONE_MASS), 0.0).share == 0.0


def test_a_speed_in_km_per_h_moves_along_a_line() -> None:
    with pytest.raises(Implausible, match="is the speed in km/h, expected m/s") as refusal:
        require_plausible_units([output(3.6)(drive())], model(TWO_MASS, motion=Motion.TRANSLATION))
    assert refusal.value.cure == Cure("run", output=pytest.approx(1.0 / 3.6))


AMBIGUOUS: dict[str, tuple[Change, tuple[str, ...]]] = {
    "a torque at the wheel": (torque(6.0, 6.0), ("torque that at the wheel", "turns per second", "speed that at the")),
    "rpm and per cent": (
        lambda record: output(9.55)(torque(1.0 / 6.0, 1.0 / 6.0)(record)),
        ("in degrees", "in rpm, expected rad/s, and is the torque in per cent of a rated torque of about 600 Nm"),
    ),
}


@pytest.mark.parametrize("fault", AMBIGUOUS)
def test_where_several_explain_it_all_are_named_and_no_line_is_given(fault: str) -> None:
    change, named = AMBIGUOUS[fault]
    with pytest.raises(Implausible) as refusal:
        require_plausible_units([change(drive())], model(TWO_MASS))
    assert refusal.value.cure is None
    assert all(each in str(refusal.value) for each in named)


def test_where_the_model_has_no_gear_ratio_it_comes_first() -> None:
    with pytest.raises(
        Implausible, match=r"What would explain it, with its odds: is the (torque|speed) that at the wheel"
    ):
        require_plausible_units([torque(6.0, 6.0)(drive())], model(TWO_MASS))


def test_no_rated_torque_is_named_that_no_drive_has() -> None:
    with pytest.raises(Implausible) as refusal:
        require_plausible_units([torque(1e-6, 1e-6)(drive())], model(TWO_MASS))
    assert "rated" not in str(refusal.value)


def test_what_is_left_after_the_line_is_said() -> None:
    wrong = replace(torque(1.0, -1.0)(drive()), name="turned")
    with pytest.raises(Implausible, match=r"With that corrected, recording (run|turned) is implausible"):
        require_plausible_units([wrong, output(30.0 / math.pi)(drive())], model(TWO_MASS))


def test_a_factor_that_physics_could_make_is_a_doubt_and_no_refusal() -> None:
    (doubt,) = require_plausible_units([torque(0.4, 0.4)(drive())], model(TWO_MASS))
    assert "per cent of a rated torque of about 250 Nm" in str(doubt)
    assert doubt.cure == Cure("run", torque=2.5)


def lessened(change: Callable[[FloatArray], FloatArray], values: dict[str, float]) -> Record:
    """A recording whose torque is read in full, and acts as changed."""
    read = 3.0 * random_steps(SAMPLES, seed=3) * np.abs(np.sin(np.arange(SAMPLES) / 300.0))
    record = linear_record(values, change(read), Start(0.0, 0.0, 3.0, 0.0, 3.0), sigma=0.02)
    return replace(record, torque_nm=read[:, np.newaxis])


OF_THE_TORQUE_PATH: dict[str, Callable[[FloatArray], FloatArray]] = {
    "a fifth": lambda torque: np.clip(torque, -60.0, 60.0),
    "a tenth": lambda torque: np.clip(torque, -30.0, 30.0),
    "a loss of nine tenths": lambda torque: torque * (1.0 - 0.9 * (1.0 - np.exp(-np.arange(SAMPLES) / 500.0))),
}


@pytest.mark.parametrize("name", OF_THE_TORQUE_PATH)
def test_what_a_torque_path_does_is_not_refused_as_a_unit(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    line, record = model(TWO_MASS), lessened(OF_THE_TORQUE_PATH[name], TWO_MASS)
    require_plausible_units([record], line)
    monkeypatch.setattr("estimator.diagnosis.preconditions.units._of_the_torque_path", lambda record: ())
    with pytest.raises(Implausible):
        require_plausible_units([record], line)


def in_per_mille(rated_nm: float) -> Change:
    return lambda record: replace(record, torque_nm=np.round(record.torque_nm / rated_nm * 1e3))


def swapped(i: int) -> Change:
    def change(record: Record) -> Record:
        torque = record.torque_nm.copy()
        torque[:, i] = record.output
        return replace(record, torque_nm=torque, output=record.torque_nm[:, i])

    return change


def as_angle(record: Record) -> Record:
    return replace(record, output=np.cumsum(record.output) * record.sample_time_s)


CURES: dict[str, tuple[Change, dict[str, object]]] = {
    "rpm": (output(60.0 / (2.0 * math.pi)), {"output": 2.0 * math.pi / 60.0}),
    "kNm": (torque(1e-3, 1e-3), {"torque": 1e3}),
    "mNm": (torque(1e3, 1e3), {"torque": 1e-3}),
    "output turned round": (output(-1.0), {"output": -1.0}),
    "one torque turned round": (torque(1.0, -1.0), {"torque": -1.0, "inputs": (1,)}),
    "ms": (in_ms, {"time": 1e-3}),
    "first torque and speed swapped": (swapped(0), {"swapped": 0}),
    "second torque and speed swapped": (swapped(1), {"swapped": 1}),
    "an angle for the speed": (as_angle, {"kind": "position"}),
}


@pytest.mark.parametrize("fault", CURES)
def test_a_refusal_says_what_to_correct(fault: str) -> None:
    change, expected = CURES[fault]
    with pytest.raises(Implausible) as refusal:
        require_plausible_units([change(drive())], model(TWO_MASS))
    cure = refusal.value.cure
    assert cure is not None
    wanted = {
        "recording": "run",
        "torque": 1.0,
        "inputs": (),
        "output": 1.0,
        "time": 1.0,
        "swapped": None,
        "kind": None,
        **expected,
    }
    for name, value in wanted.items():
        assert getattr(cure, name) == (pytest.approx(value) if isinstance(value, float) else value), name


@pytest.mark.parametrize("rated_nm", [300.0, 600.0, 1600.0])
@pytest.mark.parametrize("values", [TWO_MASS, ONE_MASS], ids=["two masses", "one mass"])
def test_per_mille_of_a_rated_torque_are_reported_with_their_scale(rated_nm: float, values: dict[str, float]) -> None:
    with pytest.raises(Implausible, match="whole per mille of a rated torque") as refusal:
        require_plausible_units([in_per_mille(rated_nm)(drive(values))], model(values))
    assert refusal.value.cure is not None
    assert refusal.value.cure.torque == pytest.approx(rated_nm / 1e3, rel=0.2)


def test_whole_newton_metres_and_a_payload_are_no_per_mille() -> None:
    whole = replace(drive(), torque_nm=np.round(drive().torque_nm))
    require_plausible_units([whole], model(TWO_MASS))
    require_plausible_units([whole], model(scaled(TWO_MASS, J_L=0.5)))


def test_per_mille_within_the_tolerance_change_no_verdict() -> None:
    """At a rated torque near 1000 Nm there is nothing to tell, and nothing that goes wrong."""
    require_plausible_units([in_per_mille(950.0)(drive())], model(TWO_MASS))


def test_a_torque_in_per_cent_is_reported_with_its_scale() -> None:
    with pytest.raises(Implausible, match="per cent of a rated torque of about") as refusal:
        require_plausible_units([torque(1.0 / 5.0, 1.0 / 5.0)(drive())], model(TWO_MASS))
    assert refusal.value.cure is not None
    assert refusal.value.cure.torque == pytest.approx(5.0, rel=0.2)


def test_a_torque_turned_round_is_reported_where_the_inertia_is_hardly_off() -> None:
    rng = np.random.default_rng(4)
    record = drive()
    own = np.cumsum(rng.normal(size=(SAMPLES, 2)), axis=0)
    acting = np.column_stack([3.0 * own[:, 0], own[:, 1]])
    moved = linear_record(TWO_MASS, acting.sum(axis=1), Start(0.0, 0.0, 0.0, 0.0, 0.0), sigma=0.02)
    read = replace(record, torque_nm=acting * np.array([1.0, -1.0]), output=moved.output)
    with pytest.raises(Implausible, match="sign of torque input 2"):
        require_plausible_units([read], model(TWO_MASS))
