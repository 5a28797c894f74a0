"""Rig files with faults: every fault by its key, what was expected, what came; and exit status 2."""

from pathlib import Path

import pytest

from hil.cli.main import run
from tests.bad_input.conftest import Refused, with_changes


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ([("[guard] ", "[guard ")], ["line {guard}, column", "expected TOML"]),
        ([("[vehicle]\ninertia_kg_m2 = 100.0", "[guard]")], ["line", "Cannot declare"]),
        (
            [("period_s = 0.01 ", 'period_s = "10ms" '), ("node_id = 1 ", "node_id = 200 "), ("cells", "cellz")],
            ["period_s | ", "inverters.m1.node_id | ", "prbs.cellz | "],
        ),
    ],
)
def test_each_fault_is_named_and_several_at_once(
    refused: Refused, tmp_path: Path, rig_text: str, changes: list[tuple[str, str]], said: list[str]
) -> None:
    rig = tmp_path / "rig.toml"
    rig.write_text(with_changes(rig_text, changes), encoding="utf-8")
    complaint = refused("run", rig, "cruise", "--dry-run")
    guard = rig_text[: rig_text.index("[guard]")].count("\n") + 1
    assert all(each.replace("{guard}", str(guard)) in complaint for each in said), complaint
    assert complaint.count(str(rig)) == len(complaint.splitlines())


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "schema | expected this key | got nothing"),
        (b"\0" * 64, "line 1, column 1 | expected TOML"),
        ("name = 'simuliert, \u00e4lter'\n".encode("latin-1"), "line 1 | expected UTF-8 text | got byte 0xe4"),
        ("name = 'x'\n".encode("utf-16"), "line 1 | expected UTF-8 text | got byte 0xff"),
    ],
)
def test_what_is_no_rig_file_is_refused(refused: Refused, tmp_path: Path, content: bytes, said: str) -> None:
    rig = tmp_path / "rig.toml"
    rig.write_bytes(content)
    assert said in refused("check", rig)


def test_a_truncated_file_lacks_what_came_after(refused: Refused, tmp_path: Path, rig_text: str) -> None:
    rig = tmp_path / "rig.toml"
    rig.write_text(rig_text[: rig_text.index("[prbs]")], encoding="utf-8")
    complaint = refused("sim", rig)
    assert "prbs | expected this key" in complaint
    assert "vehicle | expected this key" in complaint


@pytest.mark.parametrize(("name", "said"), [("none.toml", "No such file"), (".", "Is a directory")])
def test_what_can_t_be_read_is_refused(refused: Refused, tmp_path: Path, name: str, said: str) -> None:
    assert said in refused("run", tmp_path / name, "cruise", "--dry-run")


def test_a_byte_order_mark_is_no_fault(tmp_path: Path, rig_text: str, capsys: pytest.CaptureFixture[str]) -> None:
    rig = tmp_path / "rig.toml"
    rig.write_text(rig_text, encoding="utf-8-sig")
    assert run(["run", str(rig), "reversal", "--dry-run"]) == 0
    assert "speed in the recorded part" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("key", "content", "said"),
    [
        ("eds", "[DeviceInfo]\nfoo", ["rig.toml: inverters.m1.eds | expected an EDS | got: EDS", "lists no object"]),
        ("eds", "", ["rig.toml: inverters.m1.eds | expected an EDS", "no section [DeviceInfo]"]),
        ("map", 'schema = "x"\n', ["schema | expected 'hil.register_map/1'", "name | expected this key"]),
        ("map", "name = 3\ncolour = 1\n", ["name | expected a valid string", "colour | expected no such key"]),
        ("model", 'schema = "hil.model/1"\n', ["structure | expected this key", "parameters | expected this key"]),
    ],
)
def test_faults_of_the_files_it_names_are_bad_input_too(
    refused: Refused, tmp_path: Path, rig_text: str, key: str, content: str, said: list[str]
) -> None:
    shipped = {"eds": "inverter.eds", "map": "plc.toml", "model": "model.toml"}[key]
    mine = f"mine.{shipped.rpartition('.')[2]}"
    (tmp_path / mine).write_text(content, encoding="utf-8")
    rig = tmp_path / "rig.toml"
    rig.write_text(with_changes(rig_text, [(f'# {key} = "{shipped}"', f'{key} = "{mine}"')]), encoding="utf-8")
    complaint = refused("sim", rig, "--bus", "ws://127.0.0.1:0/", "--modbus", "127.0.0.1:0")
    assert all(each in complaint for each in said), complaint
