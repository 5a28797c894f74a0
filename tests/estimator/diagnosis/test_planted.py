"""Every effect of the catalogue planted by independent code (``hil.proof.truth``) in one bus, and diagnosed.

The truth has its own integrator, its own formulations and its own noise. Each effect is the planted nearest rival of
those that resemble it: what is not there must not be named. In addition: nothing missing, parameters merely off, what
the catalogue does not have, and pairs. All with the first seed whose bus shows it, none chosen; 20 s of each of the
three tests.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import pytest

from estimator.diagnosis import Diagnosis, Verdict, diagnose
from estimator.diagnosis.acquisition.chain import replay
from estimator.diagnosis.result import FoundEffect
from estimator.physics.catalogue import EFFECTS
from estimator.physics.model import DrivelineModel, Parameter, Structure
from estimator.signals.record import Record
from hil.proof.truth.bus import NOMINAL_ERROR
from hil.proof.truth.case import TESTS, TruthRecording, record
from hil.proof.truth.specimen import EFFECTS as HIDDEN, Specimen, draw_specimen
from hil.recording.signals import to_record
from hil.recording.signals_config import SignalsConfig
from hil.recording.table import Table
from tests.chosen import campaign

SEED = 1
SAMPLES = 2000
TOLERANCE = 0.2
COLUMNS = ("time_s", "torque_m1_nm", "torque_m2_nm", "speed_rad_s", "flags")


@dataclass(frozen=True)
class Planted:
    """One bus with something hidden in it, what was recorded, and the verdict."""

    specimen: Specimen
    recordings: Sequence[TruthRecording]
    diagnosis: Diagnosis

    @property
    def times_noise(self) -> float:
        return self.diagnosis.fit.retuned / self.diagnosis.fit.noise_floor

    @property
    def named(self) -> set[str]:
        return {effect.name for effect in self.diagnosis.effects}

    def effect_that_stands_for(self, name: str) -> FoundEffect:
        """The claim that holds the effect: by its name, or by one that is declared to be the same."""
        (found,) = (e for e in self.diagnosis.effects if name in (e.name, *e.indistinguishable_from))
        return found


def as_read(recording: TruthRecording, name: str, samples: int = SAMPLES) -> Record:
    """Read a recording as the tool reads a file of it."""
    columns = {column: getattr(recording, column) for column in COLUMNS}
    kept = {column: values[:samples] for column, values in columns.items() if values is not None}
    return to_record(Table(Path(f"{name}.csv"), kept), SignalsConfig())


def nominal_of(specimen: Specimen) -> DrivelineModel:
    structure = Structure.TWO_MASS
    parameters = {name: Parameter(specimen.nominal[name], TOLERANCE) for name in structure.parameter_names}
    return DrivelineModel(structure, parameters, gear_ratio=specimen.bus.gear_ratio)


def planted(name: str, seed: int = SEED, nominal_error: float = NOMINAL_ERROR, tests: int = len(TESTS)) -> Planted:
    specimen = draw_specimen(name, seed, nominal_error)
    recordings = [record(specimen, number) for number in range(tests)]
    read = [as_read(recording, f"run_{number}") for number, recording in enumerate(recordings, start=1)]
    return Planted(specimen, recordings, diagnose(read, nominal_of(specimen)))


SHOWN = 1.3
"""Error of the re-tuned nominal model over the noise from which an effect shows: drawn smaller, re-tuning hides it."""


def shown(name: str) -> Planted:
    """The first seed at which what was planted shows; faults of the acquisition show in the data themselves."""
    cases = (planted(name, seed) for seed in itertools.count(SEED))
    return next(case for case in cases if EFFECTS[name].recognised or case.times_noise >= SHOWN)


def rivals_of(name: str) -> set[str]:
    """Effects that are said to look alike in part, by either's entry."""
    listed = {other for other, entry in EFFECTS.items() if name in entry.resembles}
    return {*EFFECTS[name].resembles, *listed}


HARDLY = 0.03
"""Share of the squared error that a law written in another form than the truth's may leave (``ALIKE_SHARE``)."""


def assert_named(case: Planted, hidden: Sequence[str]) -> None:
    """All that is hidden is named, or stands as one of a pair that is the same; nothing else is."""
    assert case.diagnosis.verdict in (Verdict.EXPLAINED, Verdict.PARTLY_EXPLAINED), case.diagnosis.statement
    assert case.diagnosis.remainder is None or case.diagnosis.remainder.share < HARDLY
    claims = [case.effect_that_stands_for(name) for name in hidden]
    assert case.named == {claim.name for claim in claims}
    for name, claim in zip(hidden, claims, strict=True):
        assert not case.named & (rivals_of(name) - set(hidden) - {claim.name})
        assert set(claim.indistinguishable_from) <= rivals_of(claim.name) | set(EFFECTS[claim.name].equivalent)
        assert len(claim.indistinguishable_from) <= 1
        assert claim.element is EFFECTS[claim.name].element
        assert claim.evidence.p_value < 0.01


def assert_sized(case: Planted, name: str) -> None:
    """Sizes that the truth's law and the fitted one both have agree: written in two ways, to a quarter.

    What the recordings hardly tell, such as the grip of a tyre far from sliding, is inside its interval.
    """
    found = case.effect_that_stands_for(name).parameters
    bus = asdict(case.specimen.bus)
    for parameter in HIDDEN[name].fitted:
        true = HIDDEN[name].should_be(parameter, case.specimen.sizes[name], bus)
        if parameter in found and true is not None:
            low, high = found[parameter].ci95
            assert found[parameter].value == pytest.approx(true, rel=0.25) or low <= true <= high, parameter


def assert_placed_in_time(case: Planted, name: str) -> None:
    """Found when it happened, most of the time in either interval in both; not found where it did not happen."""
    found = case.effect_that_stands_for(name).time_s
    end_s = SAMPLES * 0.01
    for number, recording in enumerate(case.recordings, start=1):
        intervals = found.get(f"run_{number}", ())
        assert len(intervals) == len(recording.events[name])
        for (begin, end), (true_begin, true_end) in zip(intervals, recording.events[name], strict=True):
            both = min(end, true_end, end_s) - max(begin, true_begin)
            either = max(end, min(true_end, end_s)) - min(begin, true_begin)
            assert both > 0.8 * either


def assert_explains_fresh_recordings(case: Planted) -> None:
    """Recordings made after the verdict, against the noise of the speed reading."""
    fresh = [as_read(record(case.specimen, len(TESTS) + n), f"fresh_{n + 1}") for n in range(len(TESTS))]
    errors = [replay(case.diagnosis.augmented, unseen).rms for unseen in fresh]
    assert float(np.median(errors)) < 1.2 * case.diagnosis.fit.noise_floor


WITH_FRESH_RECORDINGS = ("coulomb_friction_motor", "resolver_error", "generator_coupled", "speed_quantisation")
"""A law of the motion, phases and moments of each recording's own, and a fault of the readings."""

IN_CATALOGUE = [name for name, effect in HIDDEN.items() if effect.catalogued and name in EFFECTS]
OUTSIDE = [name for name, effect in HIDDEN.items() if not effect.catalogued]


ON_AN_ARM = {"gravity", "grounded_spring"}
"""Effects of what does not roll on and on (``test_planted_arm``)."""


def test_every_effect_of_the_catalogue_is_planted() -> None:
    missing = sorted(set(EFFECTS) - set(IN_CATALOGUE) - ON_AN_ARM)
    assert not missing, (
        f"{missing}: write them again from the physics in hil/proof/truth/effects, and register them there"
    )


WITH_EVERY_CHANGE = {
    "stiffness_change",
    "resolver_error",
}
"""A law of the shaft that is an event, and one of the sensor; the others take too long: `make campaign`."""


MISSED = {
    "torque_slew": "a torque whose rate is limited is named a lag, next to a remainder",
    "torque_dropouts": "no name is given, but it is placed at the acquisition",
}
"""What is known not to be answered as it should be."""


def by_turns(names: Sequence[str]) -> list[object]:
    """Mark what is run by `make campaign` only, and what is known to be missed."""
    marks = {True: (), False: (pytest.mark.campaign,)}
    missed = {name: (pytest.mark.xfail(reason=why, strict=True),) for name, why in MISSED.items()}
    return [pytest.param(name, marks=(*marks[name in WITH_EVERY_CHANGE], *missed.get(name, ()))) for name in names]


@pytest.mark.parametrize("name", by_turns(IN_CATALOGUE))
def test_what_was_planted_is_named_and_nothing_else(name: str) -> None:
    case = shown(name)
    assert_named(case, [name])
    assert_sized(case, name)
    if EFFECTS[name].event:
        assert_placed_in_time(case, name)
    if not EFFECTS[name].recognised:
        fit = case.diagnosis.fit
        assert fit.holdout_augmented < fit.holdout_retuned
    if name in WITH_FRESH_RECORDINGS:
        assert_explains_fresh_recordings(case)


BELOW_HZ = 40.0
"""Above, samples of 10 ms hardly show what a mode does but for softening the shaft."""


def own_frequency_hz(sizes: Mapping[str, float]) -> float:
    """Frequency of an inertia on its spring, the other end held."""
    return float(np.sqrt(sizes["stiffness_nm_per_rad"] / sizes["inertia_kg_m2"])) / (2.0 * np.pi)


HUNG = pytest.mark.xfail(reason="named, but as an inertia that hangs at the motor by a spring", strict=True)


@pytest.mark.campaign
@pytest.mark.parametrize(
    "at_motor", [pytest.param(True, marks=(pytest.mark.campaign, HUNG)), False], ids=["motor", "load"]
)
def test_a_mode_is_named_with_its_frequency_on_either_side_of_the_shaft(at_motor: bool) -> None:
    """The first seed that hides one at the motor that samples of 10 ms show, and the first at the load."""
    name = "extra_torsional_mode"
    drawn = ((seed, draw_specimen(name, seed).sizes[name]) for seed in itertools.count())
    hidden = ((seed, own_frequency_hz(sizes)) for seed, sizes in drawn if bool(sizes["at_motor"]) is at_motor)
    seed, true_hz = next((seed, hz) for seed, hz in hidden if hz < BELOW_HZ or not at_motor)
    case = planted(name, seed)
    assert_named(case, [name])
    sizes = case.effect_that_stands_for(name).parameters
    assert ("between_kg_m2" if at_motor else "behind_kg_m2") in sizes
    assert sizes["frequency_hz"].ci95[0] <= true_hz <= sizes["frequency_hz"].ci95[1]
    assert sizes["frequency_hz"].value == pytest.approx(true_hz, rel=0.05)
    assert sizes["frequency_hz"].ci95[1] - sizes["frequency_hz"].ci95[0] < 0.2 * true_hz


PAIRS = (("backlash", "actuator_lag"), ("speed_quantisation", "backlash"), ("clock_drift", "coulomb_friction_motor"))


@pytest.mark.campaign
@pytest.mark.parametrize("pair", PAIRS, ids="+".join)
def test_both_of_a_pair_are_named(pair: tuple[str, str]) -> None:
    case = planted("+".join(pair))
    assert_named(case, pair)
    for name in pair:
        assert_sized(case, name)


@pytest.mark.parametrize("nominal_error", [campaign(0.0), NOMINAL_ERROR], ids=["right", "off"])
def test_nothing_missing_is_said_whether_the_parameters_are_right_or_off(nominal_error: float) -> None:
    case = planted("none", nominal_error=nominal_error)
    assert case.diagnosis.verdict is Verdict.NO_MISMATCH
    assert case.diagnosis.effects == ()
    assert not case.diagnosis.mismatch.detected
    for name in ("J_M", "J_L", "k", "c"):
        assert case.diagnosis.parameters[name].value == pytest.approx(getattr(case.specimen.bus, name), rel=0.02)


@pytest.mark.parametrize("name", by_turns(OUTSIDE))
def test_what_the_catalogue_does_not_have_is_given_no_name(name: str) -> None:
    case = planted(name)
    assert case.diagnosis.verdict is Verdict.UNEXPLAINED
    assert case.diagnosis.effects == ()
    assert case.diagnosis.mismatch.detected
    assert case.diagnosis.mismatch.element is not None
    assert case.diagnosis.mismatch.element.value == HIDDEN[name].place.value


def test_constant_direction_leaves_dry_friction_untestable() -> None:
    """Cruise alone can't tell dry friction from the constant load; the tool says so and names the test."""
    case = planted("coulomb_friction_motor", tests=1)
    untestable = {entry.name: entry.suggested_test for entry in case.diagnosis.untestable}
    assert untestable["coulomb_friction_motor"] == "reversal"
    assert case.diagnosis.verdict is Verdict.NO_MISMATCH
