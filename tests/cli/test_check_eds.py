"""``hil check --eds``: lines as a compiler writes them, JSON for a script, and exit status 2 for a file of no use."""

import json
from pathlib import Path

import pytest

from drivers.resources import data_file
from hil.cli.main import run
from tests.rig.serving import served

OTHER = str(Path(__file__).resolve().parents[2] / "examples" / "other_drive.eds")
SHIPPED = str(data_file("inverter.eds"))


@pytest.fixture
def faulty(tmp_path: Path) -> Path:
    path = tmp_path / "faulty.eds"
    text = Path(SHIPPED).read_text().replace("DefaultValue=0xFDB44700", "DefaultValue=fast")
    path.write_text(text.replace("LSS_Supported=0\n", ""))
    return path


def test_error_is_reported_with_its_line(faulty: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["check", "--eds", str(faulty)]) == 2
    printed = capsys.readouterr()
    line = faulty.read_text().split("\n").index("DefaultValue=fast") + 1
    assert f"{faulty}:{line}: error: [60A9] DefaultValue: expected a number of UNSIGNED32" in printed.out
    assert f"error: EDS {faulty} is not usable: 1 error, 2 warnings: see above." in printed.err


def test_json(faulty: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["check", "--eds", SHIPPED, "--eds", str(faulty), "--json"]) == 2
    document = json.loads(capsys.readouterr().out)
    assert document["schema"] == "hil.eds_check/1"
    assert [(file["file"], file["usable"]) for file in document["files"]] == [(SHIPPED, True), (str(faulty), False)]
    first = document["files"][1]["findings"][0]
    assert first == {
        "severity": "warning",
        "line": 14,
        "place": "[DeviceInfo] LSS_Supported",
        "expected": "this key (CiA 306)",
        "found": "none",
        "advice": "Add it.",
    }


@pytest.mark.parametrize("content", [b"", b"\x00\x01\x02", "[DeviceInfo]".encode("utf-16"), b"[can]\n"])
def test_file_that_is_no_eds(tmp_path: Path, content: bytes, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "no.eds"
    path.write_bytes(content)
    assert run(["check", "--eds", str(path)]) == 2
    assert capsys.readouterr().out.startswith(f"{path}: error: file: expected ")


def test_rig_and_eds_together(short_rig: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with served() as (server, _):
        command = ["check", str(short_rig), "--bus", server.bus_url, "--modbus", str(server.modbus), "--eds", OTHER]
        assert run(command) == 0
        printed = capsys.readouterr().out
        assert run([*command, "--json"]) == 0
        document = json.loads(capsys.readouterr().out)
    assert printed.count("agrees") == 4
    assert f"{OTHER}: usable" in printed
    assert document["schema"] == "hil.check/1"
    assert len(document["devices"]) == 4
    assert document["eds"][0]["usable"]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ([], "expected a rig file, an EDS with --eds, or both"),
        (["--eds", SHIPPED, "--bus", "virtual:x"], "expected a rig file next to them"),
        (["--eds", SHIPPED, "--prove-stop"], "expected a rig file next to them"),
    ],
)
def test_arguments_that_make_no_sense(arguments: list[str], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["check", *arguments]) == 2
    assert said in capsys.readouterr().err
