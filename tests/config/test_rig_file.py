"""The rig file: the example loads, and everything that can be wrong in one is named with its key."""

import re
from pathlib import Path

import pytest

from drivers.inverter.cia402 import TorqueMode
from drivers.plc.types import PrbsSource
from drivers.resources import data_file
from hil.config.rig_file import PrbsTarget, read_rig
from hil.errors import RigFileError

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "rig.toml"
TEXT = EXAMPLE.read_text("utf-8")


def changed(folder: Path, *changes: tuple[str, str]) -> Path:
    """The example with each pattern replaced, once and for certain."""
    text = TEXT
    for pattern, replacement in changes:
        text, count = re.subn(pattern, replacement, text, count=1, flags=re.DOTALL | re.MULTILINE)
        assert count == 1, pattern
    path = folder / "rig.toml"
    path.write_text(text, "utf-8")
    return path


def problems_of(path: Path) -> list[str]:
    with pytest.raises(RigFileError) as refusal:
        read_rig(path)
    assert str(refusal.value).startswith(str(path))
    return list(refusal.value.problems)


def in_table(table: str, key: str, value: str) -> tuple[str, str]:
    """Change one key of one table."""
    return rf"(^\[{re.escape(table)}\][^\[]*?^){key} = [^\n#]*", rf"\g<1>{key} = {value} "


def without(table: str, key: str) -> tuple[str, str]:
    return rf"(^\[{re.escape(table)}\][^\[]*?^){key} = [^\n]*\n", r"\g<1>"


class TestTheExample:
    def test_it_loads(self) -> None:
        rig = read_rig(EXAMPLE)
        assert rig.period_s == 0.01
        assert rig.can.url == "ws://127.0.0.1:54701/"
        assert (rig.plc.host, rig.plc.port, rig.plc.map) == ("127.0.0.1", 5020, None)
        assert rig.inverters.m1.mode is TorqueMode.CYCLIC_SYNCHRONOUS_TORQUE
        assert rig.inverters.m1.rated_torque_nm == rig.inverters.m2.rated_torque_nm == 600.0
        assert rig.prbs.source is PrbsSource.HOST
        assert rig.prbs.target is PrbsTarget.BOTH
        assert rig.simulation is not None
        assert rig.simulation.speed_noise_rad_s == 0.05

    def test_it_can_t_be_changed_afterwards(self) -> None:
        rig = read_rig(EXAMPLE)
        with pytest.raises(ValueError, match="frozen"):
            rig.guard.sum_limit_nm = 9999.0  # type: ignore[misc]


WRONG = [
    (("", "name", '""'), "name | expected"),
    (("", "period_s", "0.0"), "period_s | expected greater than or equal to 0.001 | got 0.0"),
    (("", "period_s", '"10ms"'), "period_s | expected a valid number | got '10ms'"),
    (("", "schema", '"hil.rig/2"'), "schema | expected 'hil.rig/1' | got 'hil.rig/2'"),
    (("can", "url", '""'), "can.url | expected"),
    (("inverters.m1", "node_id", "128"), "inverters.m1.node_id | expected less than or equal to 127 | got 128"),
    (("inverters.m2", "node_id", "1"), "inverters.m2.node_id | expected another node id than m1 | got 1"),
    (("inverters.m1", "vendor_id", "0x100000000"), "inverters.m1.vendor_id | expected less than"),
    (("inverters.m1", "rated_torque_nm", "inf"), "inverters.m1.rated_torque_nm | expected a finite number"),
    (
        ("inverters.m2", "torque_limit_nm", "601.0"),
        "inverters.m2.torque_limit_nm | expected at most rated_torque_nm of the same table (600) | ",
    ),
    (
        ("inverters.m1", "mode", '"speed"'),
        "inverters.m1.mode | expected 'cyclic_synchronous_torque' or 'profile_torque' | got 'speed'",
    ),
    (("inverters.m1", "heartbeat_ms", "1"), "inverters.m1.heartbeat_ms | expected greater than or equal to 10"),
    (("plc", "port", "0"), "plc.port | expected greater than or equal to 1 | got 0"),
    (("guard", "rate_limit_nm_per_s", "0.0"), "guard.rate_limit_nm_per_s | expected greater than 0"),
    (("guard", "prbs_limit_nm", "59.0"), "prbs.amplitude_nm | expected a part of at most guard.prbs_limit_nm (59)"),
    (
        ("guard", "sum_limit_nm", "801.0"),
        "guard.sum_limit_nm | expected at most the torque limits of m1 and m2 together (800) | got 801.0",
    ),
    (("guard", "feedback_timeout_s", "0.005"), "guard.feedback_timeout_s | expected at least one period (0.01)"),
    (("prbs", "amplitude_nm", "true"), "prbs.amplitude_nm | expected a valid number | got True"),
    (("prbs", "seed", "1024"), "prbs.seed | expected at most 1023, what 10 cells hold | got 1024"),
    (("prbs", "source", '"moon"'), "prbs.source | expected 'plc' or 'host' | got 'moon'"),
    (("prbs", "target", '"shared"'), "prbs.share_m1 | expected the part of inverter m1"),
    (("prbs", "target", '"m1"\nshare_m1 = 0.5'), "prbs.share_m1 | expected no such key while target is 'm1'"),
    (("vehicle", "inertia_kg_m2", "-1.0"), "vehicle.inertia_kg_m2 | expected greater than 0"),
    (("experiments.cruise", "kind", '"glide"'), "experiments.cruise.kind | expected one of 'cruise', 'reversal', 't"),
    (
        ("experiments.cruise", "torque_nm", "581.0"),
        "experiments.cruise.torque_nm | expected at most 580, what guard.sum_limit_nm leaves besides the PRBS",
    ),
    (
        ("experiments.cruise", "slew_nm_per_s", "4001.0"),
        "experiments.cruise.slew_nm_per_s | expected at most 4000, of which one inverter gets what guard.rate_limit_",
    ),
    (
        ("experiments.reversal", "share_m1", "0.69"),
        "experiments.reversal.torque_nm | expected at most 492.754, what inverters.m1.torque_limit_nm leaves besides",
    ),
    (
        ("experiments.tip", "share_m1", "0.0"),
        "experiments.tip.slew_nm_per_s | expected at most 2000, of which one inverter gets what guard.rate_limit_",
    ),
    (
        ("experiments.reversal", "swing_nm", "500.5"),
        "experiments.reversal.swing_nm | expected at most torque_nm of the same table (500) | got 500.5",
    ),
    (
        ("experiments.tip", "step_nm", "500.5"),
        "experiments.tip.step_nm | expected at most torque_nm of the same table (500) | got 500.5",
    ),
    (("simulation", "speed_noise_rad_s", "-0.1"), "simulation.speed_noise_rad_s | expected greater than or equal"),
]


@pytest.mark.parametrize(("change", "problem"), WRONG)
def test_a_wrong_value_is_named_with_its_key(change: tuple[str, str, str], problem: str, tmp_path: Path) -> None:
    table, key, value = change
    where = in_table(table, key, value) if table else (rf"^{key} = [^\n#]*", f"{key} = {value} ")
    assert any(line.startswith(problem) for line in problems_of(changed(tmp_path, where)))


TABLES = {
    "": ["schema", "name"],
    "can": ["url"],
    "inverters.m1": [
        "node_id",
        "vendor_id",
        "product_code",
        "rated_torque_nm",
        "torque_limit_nm",
        "mode",
        "heartbeat_ms",
    ],
    "plc": ["host", "port"],
    "guard": ["rate_limit_nm_per_s", "prbs_limit_nm", "sum_limit_nm", "feedback_timeout_s"],
    "prbs": ["amplitude_nm", "clock_divider", "seed", "source", "target"],
    "vehicle": ["inertia_kg_m2"],
    "experiments.cruise": ["duration_s", "speed_rad_s", "torque_nm", "slew_nm_per_s"],
    "experiments.reversal": ["turning_speed_rad_s", "swing_nm"],
    "experiments.tip": ["speed_rad_s", "step_nm", "step_s"],
    "simulation": ["seed", "speed_noise_rad_s", "torque_noise_permille"],
}


@pytest.mark.parametrize(("table", "key"), [(table, key) for table, keys in TABLES.items() for key in keys])
def test_a_missing_key_is_named(table: str, key: str, tmp_path: Path) -> None:
    where = without(table, key) if table else (rf"^{key} = [^\n]*\n", "")
    dotted = f"{table}.{key}" if table else key
    assert problems_of(changed(tmp_path, where)) == [f"{dotted} | expected this key | got nothing: add it"]


@pytest.mark.parametrize("table", [table for table in TABLES if table])
def test_an_unknown_key_is_named_with_those_that_are_known(table: str, tmp_path: Path) -> None:
    path = changed(tmp_path, (rf"^\[{re.escape(table)}\][^\n]*\n", rf"[{table}]\nlamda = 0.98\n"))
    (problem,) = problems_of(path)
    assert problem.startswith(f"{table}.lamda | expected one of the known keys (")
    assert all(key in problem for key in TABLES[table])


@pytest.mark.parametrize(
    ("target", "part_m1"), [('"both"', 0.5), ('"m1"', 1.0), ('"m2"', 0.0), ('"shared"\nshare_m1 = 0.25', 0.25)]
)
def test_the_part_of_the_prbs_that_m1_carries(target: str, part_m1: float, tmp_path: Path) -> None:
    path = changed(tmp_path, in_table("prbs", "target", target), in_table("prbs", "amplitude_nm", "40.0"))
    assert read_rig(path).prbs.part_m1 == part_m1


def test_simulation_and_experiments_may_be_left_out(tmp_path: Path) -> None:
    rig = read_rig(changed(tmp_path, (r"^\[experiments.cruise\].*", "")))
    assert rig.simulation is None
    assert rig.experiments == {}


class TestFilesItNames:
    def test_they_are_looked_for_next_to_it(self, tmp_path: Path) -> None:
        (tmp_path / "drive.eds").write_text(data_file("inverter.eds").read_text("utf-8"), "utf-8")
        (tmp_path / "map.toml").write_text(data_file("plc.toml").read_text("utf-8"), "utf-8")
        path = changed(tmp_path, (r'^# eds = "inverter.eds"', 'eds = "drive.eds"'), (r"^# map = .plc", 'map = "map'))
        rig = read_rig(path)
        assert rig.inverters.m1.eds == tmp_path / "drive.eds"
        assert rig.plc.map == tmp_path / "map.toml"

    @pytest.mark.parametrize(
        ("change", "key"),
        [
            ((r'^# eds = "inverter.eds"', 'eds = "none.eds"'), "inverters.m1.eds"),
            ((r'^# map = "plc.toml"', 'map = "none.toml"'), "plc.map"),
            ((r'^# model = "model.toml"', 'model = "none.toml"'), "simulation.model"),
            ((r'^# eds = "inverter.eds"', f'eds = "none{"9" * 400}.eds"'), "inverters.m1.eds"),
        ],
    )
    def test_one_that_is_not_there_or_can_t_be_is_named(
        self, change: tuple[str, str], key: str, tmp_path: Path
    ) -> None:
        (problem,) = problems_of(changed(tmp_path, change))
        assert re.match(rf"{key} \| expected an existing file, looked for {tmp_path}/none9*\.\w+ \| got 'none", problem)

    @pytest.mark.parametrize(
        ("content", "problem"),
        [
            ('schema = "hil.register_map/1"\n', "registers | expected"),
            (
                data_file("plc.toml").read_text("utf-8").replace("[registers.clutch]", "[registers.klutch]"),
                "expected a register clutch, there is none",
            ),
        ],
    )
    def test_a_register_map_with_faults_is_a_fault_of_the_rig(self, content: str, problem: str, tmp_path: Path) -> None:
        (tmp_path / "plc.toml").write_text(content, "utf-8")
        path = changed(tmp_path, (r'^# map = "plc.toml"', 'map = "plc.toml"'))
        with pytest.raises(RigFileError, match=r"plc\.toml") as refusal:
            read_rig(path)
        assert any(problem in line for line in refusal.value.problems)
        assert refusal.value.path == tmp_path / "plc.toml"


@pytest.mark.parametrize("leads", ["absolute", "up", "link"])
def test_a_file_outside_the_rigs_folder_is_read(tmp_path: Path, leads: str) -> None:
    """A maker's EDS stays where it was installed; who drives by a rig file is its author."""
    outside, home = tmp_path / "other.eds", tmp_path / "rig"
    outside.write_bytes(data_file("inverter.eds").read_bytes())
    home.mkdir()
    (home / "link.eds").symlink_to(outside)
    named = {"absolute": str(outside), "up": "../other.eds", "link": "link.eds"}[leads]
    text = EXAMPLE.read_text("utf-8").replace("[inverters.m1]", f'[inverters.m1]\neds = "{named}"', 1)
    (home / "rig.toml").write_text(text, "utf-8")
    assert read_rig(home / "rig.toml").inverters.m1.eds == outside.resolve()
