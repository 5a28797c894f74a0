"""Wrong units and signs are refused with the factor; nominal values that are off, and missing physics, are not."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.preconditions.plausible import doubts_about
from estimator.diagnosis.thresholds import Mistakes
from estimator.errors import Cure, Implausible
from estimator.physics.driveline import InitialCondition, Parameter, Structure
from estimator.physics.effect import Element
from estimator.physics.model import DrivelineModel
from estimator.signals.record import FloatArray, OutputKind, Record
from tests.campaigns.worlds import world_of
from tests.estimator.diagnosis.planted import Moved, recordings
from tests.estimator.physics.bench import ONE_MASS, TWO_MASS, linear_record, model, random_steps, scaled

Change = Callable[[Record], Record]

SAMPLES = 2000


def drive(values: dict[str, float] = TWO_MASS, kind: OutputKind = OutputKind.SPEED) -> Record:
    """Twenty seconds of random steps, shared by two inverters, one of them with a part of its own."""
    torque = random_steps(SAMPLES, seed=3)
    sigma = 1e-4 if kind is OutputKind.POSITION else 0.02
    record = linear_record(values, torque, InitialCondition(10.0, 0.0, 20.0, 0.0, 20.0), sigma=sigma, kind=kind)
    own = 10.0 * np.sin(np.arange(SAMPLES) / 7.0)
    return replace(record, torque_nm=np.column_stack([0.6 * torque + own, 0.4 * torque - own]))


def judged(record: Record, line: DrivelineModel) -> tuple[str, Cure | None]:
    """Return what is said of a recording that is refused or doubted, and its cure; nothing of one that is neither."""
    try:
        doubts = doubts_about([record], line)
    except Implausible as refusal:
        return str(refusal), refusal.cure
    return (doubts[0].statement, doubts[0].cure) if doubts else ("", None)


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
def test_a_factor_is_named(fault: str, values: dict[str, float]) -> None:
    """One of any size, as a gear ratio has, is doubted: physics may be the cause as well."""
    change, said = WRONG[fault]
    found, _ = judged(change(drive(values)), model(values))
    assert found.startswith("recording run is implausible: ")
    assert said in found


def test_a_factor_is_named_against_measured_values() -> None:
    known = {name: Parameter.measured(value, 0.1 * value, 0.1) for name, value in TWO_MASS.items()}
    line = DrivelineModel(Structure.TWO_MASS, known)
    change, said = WRONG["rpm"]
    assert said in judged(change(drive()), line)[0]


@pytest.mark.parametrize("direction", [1.0, -1.0], ids=["too large", "too small"])
def test_a_position_in_other_units(direction: float) -> None:
    wrong = output(1e3**direction)(drive(kind=OutputKind.POSITION))
    with pytest.raises(Implausible, match=r"is the (output in thousandths|torque in mNm)"):
        doubts_about([wrong], model(TWO_MASS))


@pytest.mark.parametrize("values", [TWO_MASS, ONE_MASS], ids=["two masses", "one mass"])
@pytest.mark.parametrize("kind", [OutputKind.SPEED, OutputKind.POSITION])
def test_right_units_pass(values: dict[str, float], kind: OutputKind) -> None:
    doubts_about([drive(values, kind)], model(values))


@pytest.mark.parametrize("name", sorted(TWO_MASS))
@pytest.mark.parametrize("factor", [0.8, 1.0 / 0.8])
def test_nominal_values_that_are_off_pass(name: str, factor: float) -> None:
    doubts_about([drive()], model(scaled(TWO_MASS, **{name: factor})))


LAWS: dict[str, tuple[Element, Callable[[Moved], FloatArray], float]] = {
    "a shaft that hardens": (Element.SHAFT, lambda moved: moved.twist**3, 1e5),
    "play": (Element.SHAFT, lambda moved: -4200.0 * np.clip(moved.twist, -0.01, 0.01), 1.0),
    "dry friction of a third of the torque": (Element.MOTOR, lambda moved: np.sign(moved.speed), 30.0),
    "a hill": (Element.LOAD, lambda moved: np.sin(0.3 * moved.time_s), 60.0),
    "a curved reading": (Element.SPEED_SENSOR, lambda moved: moved.speed * np.abs(moved.speed), 0.005),
}


@pytest.mark.parametrize("law", LAWS)
def test_missing_physics_passes(law: str) -> None:
    assert doubts_about(recordings(*LAWS[law]), model(TWO_MASS)) == []


@pytest.mark.parametrize("seed", [60002, 60023], ids=["a belt that slips", "a shaft softer one way"])
def test_what_two_mistakes_or_one_of_two_would_explain_is_not_refused(seed: int) -> None:
    """As a position, with another inertia, or at one of two other periods: both are rather a law without a name."""
    world = world_of("engine_outside", seed)
    assert len(doubts_about(world.records, world.model)) == 1


@pytest.mark.parametrize(("factor", "refused"), [(0.95, False), (1.05, True)])
def test_the_tolerance_widens_what_is_plausible(factor: float, refused: bool) -> None:
    """A model trusted to a factor is taken at its word."""
    wrong = output(1.0 / (1.5 * Mistakes.BEYOND * factor))(drive(ONE_MASS))
    if refused:
        assert judged(wrong, model(ONE_MASS, 0.5))[0]
    else:
        doubts_about([wrong], model(ONE_MASS, 0.5))


def lessened(change: Callable[[FloatArray], FloatArray], values: dict[str, float]) -> Record:
    """A recording whose torque is read in full, and acts as changed."""
    read = 3.0 * random_steps(SAMPLES, seed=3) * np.abs(np.sin(np.arange(SAMPLES) / 300.0))
    record = linear_record(values, change(read), InitialCondition(0.0, 0.0, 3.0, 0.0, 3.0), sigma=0.02)
    return replace(record, torque_nm=read[:, np.newaxis])


OF_THE_TORQUE_PATH: dict[str, Callable[[FloatArray], FloatArray]] = {
    "a fifth": lambda torque: np.clip(torque, -60.0, 60.0),
    "a tenth": lambda torque: np.clip(torque, -30.0, 30.0),
    "a loss of nine tenths": lambda torque: torque * (1.0 - 0.9 * (1.0 - np.exp(-np.arange(SAMPLES) / 500.0))),
}


@pytest.mark.parametrize("name", OF_THE_TORQUE_PATH)
def test_what_a_torque_path_does_is_not_refused_as_a_unit(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    line, record = model(TWO_MASS), lessened(OF_THE_TORQUE_PATH[name], TWO_MASS)
    assert doubts_about([record], line) == []
    monkeypatch.setattr("estimator.diagnosis.preconditions.candidates._of_physics", lambda records, line: ())
    assert is_doubted(record, line)


def is_doubted(record: Record, line: DrivelineModel) -> bool:
    try:
        return bool(doubts_about([record], line))
    except Implausible:
        return True


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
    _, cure = judged(change(drive()), model(TWO_MASS))
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
    found, cure = judged(in_per_mille(rated_nm)(drive(values)), model(values))
    assert "whole per mille of a rated torque" in found
    assert cure is None or cure.torque == pytest.approx(rated_nm / 1e3, rel=0.2)  # a wrong line never


def test_a_torque_turned_round_is_reported_where_the_inertia_is_hardly_off() -> None:
    rng = np.random.default_rng(4)
    record = drive()
    own = np.cumsum(rng.normal(size=(SAMPLES, 2)), axis=0)
    acting = np.column_stack([3.0 * own[:, 0], own[:, 1]])
    moved = linear_record(TWO_MASS, acting.sum(axis=1), InitialCondition(0.0, 0.0, 0.0, 0.0, 0.0), sigma=0.02)
    read = replace(record, torque_nm=acting * np.array([1.0, -1.0]), output=moved.output)
    with pytest.raises(Implausible, match="sign of torque input 2"):
        doubts_about([read], model(TWO_MASS))
