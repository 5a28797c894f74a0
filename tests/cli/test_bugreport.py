"""``hil bugreport``: what is in it, and what must never be."""

import json
import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from hil.cli.main import run
from hil.store import RunEntry, RunStore
from hil.support import command_log
from hil.support.command_log import log_file
from hil.support.redact import Redaction

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "rig.toml"

SECRETS = {
    'password = "hunter2"': "hunter2",
    "passphrase='correct horse'": "correct horse",
    'key = "/home/anna/keys/host.key"': "host.key",
    'security = { ca = "/etc/plc/ca.pem", certificate = "anna.pem", key = "anna.key" }': "anna",
    '"api_key": "abc123"': "abc123",
    'token = """line one\nline two"""': "line two",
    "-----BEGIN PRIVATE KEY-----\nMIIE\n-----END PRIVATE KEY-----": "MIIE",
    "-----BEGIN CERTIFICATE-----\nMIIC": "MIIC",
    'url = "wss://anna:hunter2@plc.example/"': "hunter2",
    'url = "wss://anna:hun@ter2@plc.example/"': "ter2",
    "ws://127.0.0.1:1/?token=abc123&x=1": "abc123",
    "hil prove make proof --key-file /mnt/vault/proof.key": "vault",
    "hil x --password hunter2": "hunter2",
    "hil x --password=hunter2": "hunter2",
    "hil run '/data/the customer/rig.toml' cruise": "customer",
    "hil run /data/customer/rig.toml cruise": "customer",
    "got: /home/anna/customer/cruise.csv: line 3": "customer",
    r"C:\Users\anna\customer\rig.toml": "customer",
    r'"C:\Users\the customer\rig.toml"': "customer",
    "user anna on annas-laptop": "anna",
    'pass = "hunter2"': "hunter2",
    "db_pass: hunter2": "hunter2",
    "pwd=hunter2": "hunter2",
    'auth = ["bert", "hunter2"]': "hunter2",
    'basic_auth: "hunter2"': "hunter2",
    "Authorization: Bearer abc123.def": "abc123",
    "got Bearer abc123def": "abc123",
    "Authorization: Basic YmVydDpodW50ZXIy": "YmVyd",
    'user = "bert"': "bert",
    "hil x --user bert": "bert",
    '"username": "bert"': "bert",
    'operator = "bert"': "bert",
    'comment = "bert was here"': "bert",
    "https://bert:hun/ter2@plc.example/x": "ter2",
    "ftp://bert@plc.example": "bert",
    "ready bus=ws://127.0.0.1:41003/GfkoLbtFsGWvu_qStyDe-CWzFLArjvay/ modbus=127.0.0.1:1": "GfkoL",
}

HARMLESS = (
    "speed_rad_s = 60.0   # rad/s, Nm/rad, kg m^2/s",
    'url = "ws://127.0.0.1:54701/"',
    'url = "socketcan:can0"',
    "object 0x1018:1 or 0x6076",
    'mode = "cyclic_synchronous_torque"  # or "profile_torque"',
    "keyboard = 3, monkeys = 4, cable = 5",
    "see docs/formats.md",
    "host = 192.168.0.10, port = 502",
    "high_pass_hz = 0.3, bypassed = 2",
    "a basic identification, passed",
)


def redaction() -> Redaction:
    return Redaction(places={"/opt/hil": "<hil>"}, names={"anna": "[user]", "annas-laptop": "[host]"})


@pytest.mark.parametrize(("text", "secret"), SECRETS.items())
def test_what_is_private_is_taken_out_and_counted(text: str, secret: str) -> None:
    found = redaction()
    assert secret not in found.text(f"before\n{text}\nafter")
    assert sum(found.counts.values()) >= 1


@pytest.mark.parametrize("text", HARMLESS)
def test_what_helps_stays(text: str) -> None:
    found = redaction()
    assert found.text(text) == text
    assert sum(found.counts.values()) == 0


def test_secrets_in_a_document_go_at_any_depth() -> None:
    document = {
        "plc": {"security": {"key": "k1", "roles": ["a"]}},
        "rig_text": 'password = "p1"',
        "n": 3,
        "token": [1, 2],
    }
    text = json.dumps(redaction().document(document))
    assert json.loads(text)["n"] == 3
    assert not [secret for secret in ("k1", "p1") if secret in text]
    assert json.loads(text)["token"] == ["[removed]", "[removed]"]


def contents(path: Path) -> dict[str, str]:
    with zipfile.ZipFile(path) as archive:
        assert archive.testzip() is None
        return {name: archive.read(name).decode() for name in archive.namelist()}


@pytest.fixture
def state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.setenv("HIL_LOG", "info")
    return tmp_path / "state"


def test_everything_is_in_it_and_listed(state: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["effects", "backlash"], keep_log=True) == 0
    rig = tmp_path / "customer" / "rig.toml"
    rig.parent.mkdir()
    text = EXAMPLE.read_text(encoding="utf-8").replace("# [plc.security]", '[plc.security]\nkey = "/home/anna/x.key"')
    rig.write_text(text, encoding="utf-8")
    capsys.readouterr()
    assert run(["bugreport", str(tmp_path / "report.zip"), "--rig", str(rig), "--runs", str(tmp_path)]) == 0
    printed = capsys.readouterr().out
    found = contents(tmp_path / "report.zip")
    assert set(found) == {"about.txt", "versions.json", "rig/rig.toml", "log/hil.log"}
    assert all(name in printed for name in found)
    assert "not in it: last run" in printed
    assert "[experiments.cruise]" in found["rig/rig.toml"]
    assert "x.key" not in found["rig/rig.toml"]
    assert "hil effects backlash" in found["log/hil.log"]
    versions = json.loads(found["versions.json"])
    assert {"canopen", "numpy", "pymodbus"} <= set(versions["packages"])


def test_the_last_run_is_reported_without_notes_and_secrets(state: Path, tmp_path: Path) -> None:
    for number, name in enumerate(("first", "last")):
        recording = tmp_path / f"{name}.csv"
        recording.write_text("time_s\n0.0\n", encoding="utf-8")
        entry = RunEntry(
            recording=recording,
            experiment=name,
            started_utc=f"2026-11-2{number}T08:00:00+00:00",
            rig_text='name = "cell 2"\npassword = "hunter2"\n',
        )
        with RunStore(tmp_path) as store:
            store.note(store.add_run(entry), "the driver was tired")
    assert run(["bugreport", str(tmp_path / "report.zip"), "--runs", str(tmp_path)]) == 0
    text = contents(tmp_path / "report.zip")["last_run.json"]
    assert json.loads(text)["experiment"] == "last"
    assert "cell 2" in text
    assert not [private for private in ("hunter2", "tired", str(tmp_path)) if private in text]


def test_it_never_replaces_a_file_and_names_what_is_missing(
    state: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "report.zip"
    out.write_text("something else", encoding="utf-8")
    assert run(["bugreport", str(out)]) == 2
    assert "expected a new file" in capsys.readouterr().err
    assert out.read_text(encoding="utf-8") == "something else"
    assert run(["bugreport", str(tmp_path / "b.zip"), "--rig", str(tmp_path / "none.toml")]) == 2
    assert "none.toml" in capsys.readouterr().err
    assert not (tmp_path / "b.zip").exists()


@pytest.fixture(autouse=True)
def log_state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A state folder of this test's own, and the log at its default level."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.delenv("HIL_LOG")
    return tmp_path / "state"


def log() -> str:
    return log_file().read_text(encoding="utf-8")


def test_it_tells_command_version_and_end() -> None:
    assert run(["effects", "backlash"], keep_log=True) == 0
    lines = log().splitlines()
    assert [line.split(" INFO hil: ")[1].split()[0] for line in lines] == ["hil", "version", "ended"]
    assert "hil effects backlash" in lines[0]
    assert all(re.match(rf"\d{{4}}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{{3}}Z {os.getpid()} ", line) for line in lines)


def test_it_tells_the_error_with_its_place_in_the_program() -> None:
    assert run(["identify", "nowhere.csv", "--out", "out"], keep_log=True) == 2
    assert "ERROR hil: ended by RecordingError" in log()
    assert "Traceback" in log()


@pytest.mark.parametrize(("level", "reported"), [("error", False), ("warning", False), ("info", True), ("debug", True)])
def test_the_level_is_that_of_the_option(level: str, reported: bool) -> None:
    assert run(["--log-level", level, "effects"], keep_log=True) == 0
    assert ("hil effects" in log()) is reported


@pytest.mark.parametrize("where", ["option", "variable"])
def test_an_unknown_level_is_refused(
    where: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    if where == "variable":
        monkeypatch.setenv("HIL_LOG", "loud")
    options = ["--log-level", "loud"] if where == "option" else []
    assert run([*options, "effects"], keep_log=True) == 2
    error = capsys.readouterr().err
    assert "expected one of debug, info, warning, error, off, got 'loud'" in error
    assert ("--log-level" if where == "option" else "HIL_LOG") in error


def test_nobody_else_can_read_it_and_it_holds_no_secret() -> None:
    log_file().parent.mkdir(parents=True)
    old = log_file().with_name("hil.log.1")
    for path in (log_file(), old):
        path.touch(mode=0o644)
    assert run(["effects", "--password", "hunter2", "wss://bert:hunter2@plc.example/"], keep_log=True) == 2
    for path in (log_file(), old):
        assert path.stat().st_mode & 0o077 == 0
    assert "hil effects --password" in log()
    assert "hunter2" not in log()
    assert "bert" not in log()


def test_it_rotates_and_keeps_a_few(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(command_log, "BYTES", 500)
    for _ in range(12):
        assert run(["effects", "backlash"], keep_log=True) == 0
    kept = sorted(log_file().parent.iterdir())
    assert [path.name for path in kept] == ["hil.log", *(f"hil.log.{n}" for n in range(1, command_log.OLDER_LOGS + 1))]
    assert all(path.stat().st_size <= 500 for path in kept)


def test_the_console_script_keeps_it() -> None:
    done = subprocess.run([sys.executable, "-m", "hil", "effects", "backlash"], capture_output=True, check=True)
    assert done.returncode == 0
    assert "hil effects backlash" in log()
