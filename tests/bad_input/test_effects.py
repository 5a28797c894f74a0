"""Effects that do not exist, or not so: in the catalogue and put into the simulated rig."""

from pathlib import Path

import pytest

from tests.bad_input.conftest import Refused


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("gremlins", "effect 'gremlins': expected one of"),
        ("", "effect '': expected one of"),
        ("Backlash", "Did you mean backlash?"),
    ],
)
def test_the_catalogue_names_what_it_has(refused: Refused, name: str, said: str) -> None:
    complaint = refused("effects", name)
    assert said in complaint
    assert "coulomb_friction_motor" in complaint


@pytest.mark.parametrize(
    ("effects", "said"),
    [
        (["gremlins:size=1"], "effects.gremlins: unknown effect, expected one of"),
        (["backlash"], "effect 'backlash': expected at least one of its parameters (gap_rad"),
        (["backlash:gap=0.1"], "effects.backlash.gap: unknown parameter, expected gap_rad"),
        (["backlash:gap_rad"], "effect 'backlash:gap_rad': expected key=number, got 'gap_rad'"),
        (["backlash:gap_rad=wide"], "expected key=number, got 'gap_rad=wide'"),
        (["backlash:gap_rad=-1"], "effects.backlash.gap_rad.value: expected a number 0 or greater, got -1.0"),
        (["backlash:gap_rad=nan"], "effects.backlash.gap_rad.value: expected a finite number, got nan"),
        (["backlash:gap_rad=1,gap_rad=2"], "expected 'gap_rad' once, got twice"),
        (["backlash:gap_rad=1", "backlash:gap_rad=2"], "effect 'backlash': expected once, got twice"),
        (["transport_delay:delay_s=100"], "effect 'transport_delay': delay_s is 100, expected 0 to 0.2 s, the cat"),
        (["stiffness_nonlinearity:hardening_per_rad2=-1e6"], "hardening_per_rad2 is -1e+06, expected -1.44e+03 to"),
        (["stiffness_nonlinearity:hardening_per_rad2=1,shape=9"], "shape is 9, expected 0.1 to 3, the catalogue's"),
        (["road_grade:grade_rms_nm=20"], "effect 'road_grade': expected an effect with a constant law, got one that"),
        (["stribeck_friction:excess_nm=20"], "effects.stribeck_friction.stribeck_rad_s: missing, expected"),
        (["stribeck_friction:excess_nm=20,coulomb_nm=5,stribeck_rad_s=0"], "stribeck_rad_s is 0, expected 0.32 to 320"),
        ([""], "effect '': expected NAME:key=number, got no name"),
    ],
)
def test_the_simulated_rig_refuses_them(refused: Refused, short_rig: Path, effects: list[str], said: str) -> None:
    options = [word for effect in effects for word in ("--effect", effect)]
    assert said in refused("sim", short_rig, "--bus", "ws://127.0.0.1:0/", "--modbus", "127.0.0.1:0", *options)
