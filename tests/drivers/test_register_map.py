"""The map file: all faults at once, and few requests."""

import re
from pathlib import Path

import pytest

from drivers.plc.register import RegisterKind
from drivers.plc.register_map import (
    ENUMS,
    MOST_REGISTERS,
    USED,
    Block,
    RegisterMap,
    RegisterMapError,
    blocks_of,
    load_register_map,
    require_usable,
)
from drivers.plc.types import DriveMode
from drivers.resources import data_file

SHIPPED = data_file("plc.toml")
TEXT = SHIPPED.read_text("utf-8")


@pytest.fixture
def shipped() -> RegisterMap:
    return load_register_map(SHIPPED)


def changed(folder: Path, *changes: tuple[str, str]) -> Path:
    """The shipped map with each pattern replaced, once and for certain."""
    text = TEXT
    for pattern, replacement in changes:
        text, count = re.subn(pattern, replacement, text, count=1, flags=re.DOTALL)
        assert count == 1, pattern
    path = folder / "map.toml"
    path.write_text(text, "utf-8")
    return path


def test_the_shipped_map_is_usable_and_names_every_mode(shipped: RegisterMap) -> None:
    require_usable(shipped)
    assert set(shipped["drive_mode"].values or {}) == {mode.value for mode in DriveMode}
    assert set(ENUMS) <= set(USED) <= set(shipped.registers)


def test_the_shipped_map_is_read_in_one_request_per_kind(shipped: RegisterMap) -> None:
    blocks = blocks_of(shipped, shipped.registers)
    assert [(block.kind, block.address, block.count) for block in blocks] == [
        (RegisterKind.COIL, 0, 1),
        (RegisterKind.DISCRETE_INPUT, 0, 1),
        (RegisterKind.HOLDING_REGISTER, 0, 7),
        (RegisterKind.INPUT_REGISTER, 0, 13),
    ]


def test_a_gap_starts_a_new_request(shipped: RegisterMap) -> None:
    assert blocks_of(shipped, ["prbs_seed", "prbs_source", "host_count"]) == (
        Block(RegisterKind.HOLDING_REGISTER, 0, 1, ("host_count",)),
        Block(RegisterKind.HOLDING_REGISTER, 5, 2, ("prbs_seed", "prbs_source")),
    )


def test_a_request_is_no_longer_than_modbus_allows(shipped: RegisterMap) -> None:
    entry = shipped["plc_count"]
    many = {f"r{k}": entry.model_copy(update={"address": k}) for k in range(300)}
    blocks = blocks_of(shipped.model_copy(update={"registers": many}), many)
    assert [block.count for block in blocks] == [MOST_REGISTERS, MOST_REGISTERS, 50]


def test_all_faults_at_once_each_with_its_key(tmp_path: Path) -> None:
    path = changed(
        tmp_path,
        ("device_id = 1", "device_id = 256"),
        ('name = "series', 'nome = "series'),
        (r"(\[registers.drive_mode\].*?)address = 4", r'\1address = "four"'),
        (r'(\[registers.speed_limit\].*?)word_order = "low_word_first"\n', r"\1"),
        ("scale = 0.1", "scale = -0.1"),
    )
    with pytest.raises(RegisterMapError) as refusal:
        load_register_map(path)
    keys = {problem.split(" | ")[0] for problem in refusal.value.problems}
    assert keys == {
        "name",
        "nome",
        "device_id",
        "registers.drive_mode.address",
        "registers.speed_limit",
        "registers.torque_limit.scale",
    }
    assert refusal.value.path == path
    assert str(path) in str(refusal.value)


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        ((r"address = 5\n", "address = 4\n"), "registers.clutch.address | expected 5 or more, behind drive_mode"),
        ((r"address = 8\n", "address = 7\n"), "registers.torque_limit.address | expected 8 or more"),
        ((r"map_version = 1", "map_vision = 1"), "identity.map_vision | expected the name of a register"),
        ((r"map_version = 1", "map_version = 70000"), "identity.map_version | expected a value that uint16 holds"),
        ((r"vendor_code = .*?map_version = 1", ""), "identity | expected at least one register"),
    ],
)
def test_rules_across_entries(change: tuple[str, str], problem: str, tmp_path: Path) -> None:
    with pytest.raises(RegisterMapError, match=re.escape(problem)):
        load_register_map(changed(tmp_path, change))


@pytest.mark.parametrize(
    ("content", "problem"),
    [(b"schema = \n", "expected TOML in UTF-8.*line 1"), (b"# caf\xe9", "expected TOML in UTF-8.*0xe9")],
)
def test_what_is_not_toml_is_refused(content: bytes, problem: str, tmp_path: Path) -> None:
    path = tmp_path / "map.toml"
    path.write_bytes(content)
    with pytest.raises(RegisterMapError, match=problem):
        load_register_map(path)
