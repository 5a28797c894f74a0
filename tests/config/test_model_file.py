"""The model file: read, written back, and refused with every fault at once."""

from pathlib import Path

import pytest
from hypothesis import given, settings, strategies as st

from estimator.physics.catalogue import EFFECTS
from estimator.physics.machine import PARTS
from estimator.physics.model import DrivelineModel, EffectValue, Load, Motion, Parameter, Prior, Structure
from estimator.physics.tables import table_of
from estimator.signals.record import Location, OutputKind
from hil.config.model_file import read_model, read_model_for_recordings, write_model
from hil.errors import ModelFileError
from hil.recording import SignalsConfig

ONE_MASS = """
schema = "hil.model/1"
structure = "one_mass"
motion = "rotation"
[parameters]
J_M = { value = 1.6, tolerance = 0.2 }
b_M = { value = 0, tolerance = 0 }
"""

TWO_MASS = """
schema = "hil.model/1"
structure = "two_mass"
[parameters]
J_M = { value = 1.6, tolerance = 0.2 }
J_L = { value = 95.0, tolerance = 0.2 }
k = { value = 4200, tolerance = 0.2 }
c = { value = 9.0, tolerance = 0.2 }
b_M = { value = 0.35, tolerance = 0.2 }
b_L = { value = 0.9, tolerance = 0.2 }
[geometry]
gear_ratio = 5.6
"""


def write(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "model.toml"
    path.write_text(text)
    return path


def refusal(tmp_path: Path, text: str) -> list[str]:
    path = write(tmp_path, text)
    with pytest.raises(ModelFileError) as caught:
        read_model(path)
    lines = str(caught.value).splitlines()
    assert all(line.startswith(f"{path}: ") for line in lines)
    return [line.removeprefix(f"{path}: ") for line in lines]


def test_a_nominal_file_becomes_a_model(tmp_path: Path) -> None:
    file = read_model(write(tmp_path, TWO_MASS))
    assert file.signals is None
    assert file.model.structure is Structure.TWO_MASS
    assert file.model.motion is Motion.ROTATION
    assert file.model.gear_ratio == 5.6
    assert file.model.effects == {}
    assert file.model.parameters["k"] == Parameter(4200.0, 0.2)
    assert list(file.model.values()) == ["J_M", "J_L", "k", "c", "b_M", "b_L"]


@pytest.mark.parametrize(
    ("table", "load"),
    [
        ("", Load.OWN),
        ("[load]", Load.OWN),
        ('[load]\nconstant = "own"', Load.OWN),
        ('[load]\nconstant = "shared"', Load.SHARED),
        ("[load]\nconstant = -3", -3.0),
    ],
)
def test_the_constant_load_is_own_shared_or_a_number(tmp_path: Path, table: str, load: Load | float) -> None:
    assert read_model(write(tmp_path, f"{ONE_MASS}\n{table}\n")).model.load == load


def test_signals_say_how_a_recording_is_read(tmp_path: Path) -> None:
    text = """
    [signals]
    time = { sample_time_s = 0.001 }
    torque = [ { column = "a" }, { column = "b", scale = -2 } ]
    position = { column = "q", scale = 0.5, at = "load" }
    mask = [ { column = "Throttle [%]", min = 2.0 } ]
    format = { delimiter = ";", encoding = "latin-1" }
    """
    signals = read_model(write(tmp_path, ONE_MASS + text)).signals
    assert signals is not None
    assert signals.time.sample_time_s == 0.001
    assert [(torque.column, torque.scale) for torque in signals.torques()] == [("a", 1.0), ("b", -2.0)]
    kind, output = signals.output()
    assert (kind, output.column, output.scale, output.at) == (OutputKind.POSITION, "q", 0.5, Location.LOAD)
    assert (signals.format.delimiter, signals.format.encoding) == (";", "latin-1")


def test_the_example_of_the_joint_names_motion_and_force() -> None:
    file = read_model_for_recordings(Path(__file__).parents[2] / "examples" / "joint.toml")
    assert file.on_bench
    assert file.model.parameters.keys() == {"k", "c"}
    assert file.model.effects == {}


@pytest.mark.parametrize(
    "signals", ["", "[signals]\nposition = { column = 'x' }", "[signals]\ntorque = [{ column = 'f' }]"]
)
def test_a_joint_needs_both_its_motion_and_what_it_takes(tmp_path: Path, signals: str) -> None:
    path = tmp_path / "joint.toml"
    parameters = "k = { value = 1, tolerance = 0.2 }\nc = { value = 1, tolerance = 0.2 }"
    path.write_text(f'schema = "hil.model/1"\nstructure = "joint"\n[parameters]\n{parameters}\n{signals}\n')
    with pytest.raises(ModelFileError, match=r"signals \| expected position .* and torque or force"):
        read_model_for_recordings(path)
    assert read_model(path).on_bench


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ('schema = "hil.model/2"', "schema | expected 'hil.model/1' | got 'hil.model/2'"),
        (
            'structure = "four_mass"',
            "structure | expected 'one_mass', 'two_mass', 'three_mass' or 'joint' | got 'four_mass'",
        ),
        ("structure = [1]", "structure | expected 'one_mass', 'two_mass', 'three_mass' or 'joint' | got [1]"),
        ('motion = "sideways"', "motion | expected 'rotation' or 'translation' | got 'sideways'"),
        ("J_M = { value = '1', tolerance = 0.2 }", "parameters.J_M.value | expected a valid number | got '1'"),
        ("J_M = { value = true, tolerance = 0.2 }", "parameters.J_M.value | expected a valid number | got True"),
        ("J_M = { value = nan, tolerance = 0.2 }", "parameters.J_M.value | expected a finite number | got nan"),
        (
            "J_M = { value = 1 }",
            "parameters.J_M.tolerance | expected what the value is trusted to, or ci95 = [low, high]",
        ),
        (
            "J_M = { value = 1, tolerance = 0.2, ci95 = [0.5, 2] }",
            "parameters.J_M.tolerance | expected what the value is trusted to, or ci95 = [low, high] in",
        ),
        ("J_M = { value = 1, ci95 = [2, 3] }", "parameters.J_M.ci95: expected two finite numbers with the value, 1.0,"),
        (
            "b_M = { value = 0, tolerance = 0.2 }",
            "parameters.b_M.tolerance: expected 0 for a value of 0, of which every",
        ),
        (
            "J_M = { value = 1, tolerance = 0.2, x = 1 }",
            "parameters.J_M.x | expected one of the known keys (value, tol",
        ),
        ("J_M = 1.6", "parameters.J_M | expected a table of value, tolerance"),
        (
            "J_M = { value = 0, tolerance = 0.2 }",
            "parameters.J_M.value: expected a finite number greater than 0, got 0",
        ),
        (
            "J_M = { value = 1, tolerance = 1 }",
            "parameters.J_M.tolerance: expected a relative tolerance from 0 up to 1",
        ),
    ],
)
def test_a_wrong_line_is_refused_by_its_key(tmp_path: Path, line: str, said: str) -> None:
    key = line.split(" =")[0]
    text = "\n".join(line if old.startswith(f"{key} =") else old for old in ONE_MASS.splitlines())
    assert line in text
    lines = refusal(tmp_path, text)
    assert len(lines) == 1
    assert lines[0].startswith(said)


@pytest.mark.parametrize(
    ("added", "said"),
    [
        ("k = { value = 1, tolerance = 0 }", "parameters.k: unknown, one_mass has J_M, b_M"),
        ("[geometry]\ngear_ratio = 0", "geometry.gear_ratio | expected greater than 0 | got 0"),
        ('[load]\nconstant = "everyone\'s"', "load.constant | expected"),
        ("[load]\nconst = 5", "load.const | expected one of the known keys (constant)"),
        ("[effects.gremlins]\nsize = { value = 1 }", "effects.gremlins: unknown effect, expected one of"),
        (
            "[effects.backlash]\ngap_rad = { value = 1 }",
            "effects.backlash: makes no sense in one_mass, expected joint, three_mass, two_mass",
        ),
        ("[effects.coulomb_friction_motor]", "effects.coulomb_friction_motor.friction_nm: missing"),
        (
            "[effects.coulomb_friction_motor]\nfriction_nm = { value = 0, tolerance = 0.3 }",
            "effects.coulomb_friction_motor.friction_nm.tolerance: expected none for a value of 0",
        ),
        (
            "[machine]\nhas = ['sail']",
            "machine.has: expected parts among brake, clutch, payload, tyre, resolver, got 's",
        ),
        ("[machine]\nhas = 'brake'", "machine.has | expected a list in [ ] | got 'brake'"),
        (
            "[machine]\nhas = []\n[effects.inertia_change]\nchange_kg_m2 = { value = 1 }",
            "machine.has: expected 'payload' in it, since the model has effects.inertia_change, got none",
        ),
        ("[priors]\ngremlins = { odds = 1.0 }", "priors.gremlins: unknown effect, expected one of"),
        ("[priors]\nbacklash = { odds = 0.0 }", "priors.backlash.odds: expected odds above 0"),
        (
            "[priors]\nbacklash = { gap_deg = [1, 2] }",
            "priors.backlash.gap_deg: unknown parameter, expected odds or one",
        ),
        ("[priors]\nbacklash = { gap_rad = [2, 1] }", "priors.backlash.gap_rad: expected two numbers, the lower first"),
        ("[priors]\nbacklash = { gap_rad = [-2, 1] }", "priors.backlash.gap_rad: expected sizes of 0 or greater"),
        ("[priors]\nbacklash = { gap_rad = 0.01 }", "priors.backlash.gap_rad | expected a list in [ ] | got 0.01"),
        ("[priors]\nbacklash = { }", "priors.backlash: expected odds or the range of a parameter, got neither"),
        (
            "[effects.coulomb_friction_motor]\nfriction_nm = { value = 1, ci95 = [2, 1] }",
            "effects.coulomb_friction_motor.friction_nm.ci95 | expected the lower bound first",
        ),
        (
            "[effects.coulomb_friction_motor]\nfriction_nm = { value = 1, ci95 = [2, 3] }",
            "effects.coulomb_friction_motor.friction_nm.ci95 | expected the lower bound first, and the value, 1, "
            "between both | got [2.0, 3.0]",
        ),
        (
            "[effects.coulomb_friction_motor]\nfriction_nm = { value = 1, ci95 = [0.5, inf] }",
            "effects.coulomb_friction_motor.friction_nm.ci95.1 | expected a finite number | got inf",
        ),
        (
            "[tables.torque]\nknots = [0, 1]\nvalues = [0, 2]\nci95 = [[0, 0], [3, 4]]",
            "tables.torque.ci95.1 | expected the value there, 2, between both bounds | got [3.0, 4.0]",
        ),
        (
            "[effects.coulomb_friction_motor]\nfriction_nm = 3",
            "effects.coulomb_friction_motor.friction_nm | expected a table of value, ci95",
        ),
        ("[effects.clock_drift]\nrate = 3e-4", "effects.clock_drift.rate | expected a table of value, ci95"),
        (
            "[signals]\nspeed = { column = 'v', at = 'roof' }",
            "signals.speed.at | expected 'motor', 'load' or 'shaft' | got 'roof'",
        ),
        ("[signals]\nspeed = { column = 'v', scale = 0 }", "signals.speed.scale | expected a number other than 0"),
        (
            "[signals]\nspeed = { column = 'v' }\nforce = { column = 'f' }",
            "signals | expected one of speed, position, force",
        ),
        ("[signals]\ntime = { }", "signals.time | expected either column or sample_time_s | got 'neither'"),
        (
            "[signals]\ntime = { column = 't', sample_time_s = 1 }",
            "signals.time | expected either column or sample_time_s",
        ),
        ("[signals]\ntime = { sample_time_s = 0 }", "signals.time.sample_time_s | expected greater than 0 | got 0"),
        ("[signals]\nmask = [ { column = 'a' } ]", "signals.mask.0 | expected min, max or both | got 'neither'"),
        ("[signals]\nmask = [ { column = 'a', min = 2, max = 1 } ]", "signals.mask.0.max | expected 2.0 or more"),
        ("[signals]\nformat = { encoding = 'klingon' }", "signals.format.encoding | expected a text encoding such as"),
        (
            "[signals]\nformat = { delimiter = '.' }",
            "signals.format.delimiter | expected a character that can't be part",
        ),
        ("[signals]\nlevel = { column = 'a' }", "signals.level | expected one of the known keys (time, torque, speed,"),
    ],
)
def test_a_wrong_addition_is_refused_by_its_key(tmp_path: Path, added: str, said: str) -> None:
    lines = refusal(tmp_path, f"{ONE_MASS}{added}\n")
    assert any(line.startswith(said) for line in lines), lines


finite = st.floats(min_value=1e-12, max_value=1e12)


@st.composite
def parameters(draw: st.DrawFn) -> Parameter:
    if draw(st.booleans()):
        return Parameter(draw(finite), draw(st.floats(0, 0.99)))
    low, value, high = sorted([draw(finite), draw(finite), draw(finite)])
    return Parameter(value, ci95=(low, high))


@st.composite
def effects_of(draw: st.DrawFn, name: str) -> dict[str, EffectValue]:
    pairs = st.tuples(finite, finite).map(lambda pair: (min(pair), max(pair)))
    parameters = EFFECTS[name].parameters
    values = {each.name: min(draw(finite), each.most) for each in parameters}
    if EFFECTS[name].event:
        values["from_s"], values["to_s"] = sorted([values["from_s"], values["to_s"]])
    return {key: EffectValue(value, draw(st.none() | pairs)).at(value) for key, value in values.items()}


@st.composite
def models(draw: st.DrawFn) -> DrivelineModel:
    structure = draw(st.sampled_from(Structure))
    fitting = sorted(name for name, entry in EFFECTS.items() if structure in entry.structures)
    chosen = draw(st.lists(st.sampled_from(fitting), unique=True, max_size=3))
    return DrivelineModel(
        structure=structure,
        motion=draw(st.sampled_from(Motion)),
        parameters={name: draw(parameters()) for name in structure.parameter_names},
        effects={name: draw(effects_of(name)) for name in chosen},
        gear_ratio=draw(st.none() | finite),
        load=draw(st.sampled_from(Load) | finite),
        has=draw(st.none() | st.just(frozenset(PARTS))),
        priors=draw(st.just({}) | st.just({"backlash": Prior(0.5, {"gap_rad": (0.005, 0.05)}), "gravity": Prior(2.0)})),
    )


def test_parts_and_priors_are_what_the_model_knows(tmp_path: Path) -> None:
    added = "[machine]\nhas = ['brake']\n[priors]\nbacklash = { odds = 0.5, gap_rad = [0.005, 0.05] }\n"
    model = read_model(write(tmp_path, TWO_MASS + added)).model
    assert model.has == {"brake"}
    assert model.prior("backlash") == Prior(0.5, {"gap_rad": (0.005, 0.05)})
    assert model.prior("gravity") == Prior()
    assert read_model(write(tmp_path, TWO_MASS)).model.has is None


names = st.text(st.characters(codec="utf-8", exclude_categories=("Cs",)), min_size=1, max_size=10)


@st.composite
def signals_configs(draw: st.DrawFn) -> SignalsConfig:
    scaled = st.fixed_dictionaries({"column": names}, optional={"scale": finite})
    content = draw(
        st.fixed_dictionaries(
            {},
            optional={
                "time": st.fixed_dictionaries({"column": names}) | st.fixed_dictionaries({"sample_time_s": finite}),
                "torque": st.lists(scaled, min_size=1, max_size=3),
                draw(st.sampled_from(["speed", "position", "force"])): scaled,
                "mask": st.lists(st.fixed_dictionaries({"column": names, "min": finite}), max_size=2),
                "format": st.just({"delimiter": ";", "encoding": "latin-1"}),
            },
        )
    )
    return SignalsConfig.model_validate(content)


@given(models(), st.none() | signals_configs())
@settings(max_examples=20, deadline=None)
def test_what_is_written_reads_back_the_same(
    tmp_path_factory: pytest.TempPathFactory, model: DrivelineModel, signals: SignalsConfig | None
) -> None:
    path = tmp_path_factory.getbasetemp() / "written.toml"
    write_model(path, model, signals)
    file = read_model(path)
    assert file.model == model
    assert file.signals == signals


def test_an_effect_that_is_known_roughly_says_how_far_it_is_trusted(tmp_path: Path) -> None:
    text = ONE_MASS + "\n[effects.coulomb_friction_motor]\nfriction_nm = { value = 5.0, tolerance = 0.3 }\n"
    (tmp_path / "m.toml").write_text(text)
    model = read_model(tmp_path / "m.toml").model
    assert model.effects["coulomb_friction_motor"]["friction_nm"] == EffectValue(5.0, None, 0.3)
    write_model(tmp_path / "again.toml", model)
    assert read_model(tmp_path / "again.toml").model == model


@pytest.mark.parametrize("tolerance", ["1.0", "-0.1", "nan"])
def test_a_tolerance_of_an_effect_is_a_share_below_one(tmp_path: Path, tolerance: str) -> None:
    text = ONE_MASS + f"\n[effects.coulomb_friction_motor]\nfriction_nm = {{ value = 5.0, tolerance = {tolerance} }}\n"
    (tmp_path / "m.toml").write_text(text)
    with pytest.raises(ModelFileError, match=r"coulomb_friction_motor\.friction_nm\.tolerance"):
        read_model(tmp_path / "m.toml")


CURVE = """
[tables.shaft_twist]
knots = [-0.04, -0.02, 0.0, 0.02, 0.04]
values = [-120.0, -40.0, 0.0, 40.0, 120.0]
ci95 = [[-124.0, -116.0], [-43.0, -37.0], [-2.0, 2.0], [37.0, 43.0], [116.0, 124.0]]
damping = 1.5
"""


def test_a_law_without_a_name_is_read_and_written_back(tmp_path: Path) -> None:
    model = read_model(write(tmp_path, TWO_MASS + CURVE)).model
    law = table_of("table_shaft_twist", model.effects["table_shaft_twist"])
    assert (law.place, law.knots[0], law.values[-1], law.damping) == ("shaft_twist", -0.04, 120.0, 1.5)
    assert law.ci95 is not None
    assert law.ci95[1] == (-43.0, -37.0)
    again = tmp_path / "again.toml"
    write_model(again, model)
    assert "[tables.shaft_twist]" in again.read_text()
    assert "[effects" not in again.read_text()
    assert read_model(again).model.effects == model.effects


def test_tables_that_are_no_curves_are_refused_with_every_fault(tmp_path: Path) -> None:
    tables = """
[tables.shaft_twist]
knots = [0.0, -0.01, 0.02]
values = [0.0, 1.0]
ci95 = [[2.0, 1.0], [0.0, 1.0]]
[tables.wheel]
knots = [0.0, 1.0]
values = [0.0, 1.0]
[tables.torque]
knots = "none"
values = [0.0]
"""
    assert refusal(tmp_path, TWO_MASS + tables) == [
        "tables.torque.knots | expected a list in [ ] | got 'none'",
        "tables.shaft_twist.knots | expected finite numbers, each larger than the one before | got [0.0, -0.01, 0.02]",
        "tables.shaft_twist.values | expected as many as knots, 3 | got 2",
        "tables.shaft_twist.ci95 | expected the lower bound first in every interval | got [[2.0, 1.0], [0.0, 1.0]]",
        "tables.wheel | expected one of torque, motor_speed, shaft_twist, shaft_rate, load_speed, load_angle | "
        "got 'wheel'",
    ]


def test_a_table_is_no_effect_and_needs_its_place(tmp_path: Path) -> None:
    as_effect = "[effects.table_torque]\nknots = { value = 2 }\n"
    assert refusal(tmp_path, TWO_MASS + as_effect) == [
        "effects.table_torque | expected it as data | got an effect: write it as [tables.torque]"
    ]
    found = refusal(tmp_path, ONE_MASS + "[tables.load_speed]\nknots = [0.0, 1.0]\nvalues = [0.0, 1.0]\n")
    assert found == ["tables.load_speed: makes no sense in one_mass, expected three_mass, two_mass"]
