"""``hil rig new``: by options, by a person at a real terminal, with wrong answers, never over a file."""

import fcntl
import os
import pty
import subprocess
import sys
import termios
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import given, settings, strategies as st

from hil.cli.main import run
from hil.config.new_rig import QUESTIONS, answers, rig_text
from hil.config.rig_file import read_rig
from hil.config.table import FileKind
from hil.errors import UsageError
from tests.cli.test_schema import faults

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "rig.toml"

VEHICLE = {
    "plc": "192.168.0.10:502",
    "vendor_id": "0x3E7",
    "product_code": "1026",
    "rated_torque_nm": "300",
    "torque_limit_nm": "90",
    "inertia_kg_m2": "80",
    "speed_rad_s": "40",
}


def options(given: dict[str, str]) -> list[str]:
    return [word for name, value in given.items() for word in ("--" + name.replace("_", "-"), value)]


def test_the_simulated_rig_is_the_example(tmp_path: Path) -> None:
    path = tmp_path / "rig.toml"
    assert run(["rig", "new", str(path), "--simulated", "--yes"]) == 0
    example = read_rig(EXAMPLE)
    assert read_rig(path) == example.model_copy(update={"name": "simulated bus"})
    assert (tmp_path / FileKind.RIG.value).is_file()
    assert path.read_text(encoding="utf-8").startswith("#:schema ./rig.schema.json\n")


def test_a_vehicle_by_options(tmp_path: Path) -> None:
    path = tmp_path / "rig.toml"
    assert run(["rig", "new", str(path), "--yes", *options(VEHICLE), "--name", 'a "bus" # 2']) == 0
    rig = read_rig(path)
    assert (rig.name, rig.plc.host, rig.plc.port) == ('a "bus" # 2', "192.168.0.10", 502)
    assert rig.inverters.m1.product_code == rig.inverters.m2.product_code == 1026
    assert rig.inverters.m1.torque_limit_nm == rig.inverters.m2.torque_limit_nm == 90.0
    assert rig.simulation is None
    assert faults(FileKind.RIG, tomllib.loads(path.read_text(encoding="utf-8"))) == []


@settings(max_examples=20, deadline=None)
@given(
    limit_nm=st.floats(1.0, 5000.0),
    rated=st.floats(1.0, 10.0),
    speed_rad_s=st.floats(0.1, 400.0),
    name=st.text(min_size=1).filter(lambda text: text.strip() and text.isprintable()),
)
def test_whatever_the_limit_the_file_holds_together(
    limit_nm: float, rated: float, speed_rad_s: float, name: str
) -> None:
    given = {"torque_limit_nm": repr(limit_nm), "rated_torque_nm": repr(limit_nm * rated)}
    found = answers(VEHICLE | given | {"speed_rad_s": repr(speed_rad_s), "name": name}, simulated=False)
    text = rig_text(found, Path("rig.toml"), simulated=False)  # refused if a rule across keys is broken
    document = tomllib.loads(text)
    assert document["name"] == name.strip()
    assert document["inverters"]["m1"]["torque_limit_nm"] == limit_nm
    assert document["guard"]["sum_limit_nm"] <= 2.0 * limit_nm


def test_all_wrong_options_are_named_at_once() -> None:
    wrong = {
        "name": " ",
        "can": "can0",
        "period_s": "0.0001",
        "plc": "192.168.0.10",
        "node_m1": "5",
        "node_m2": "5",
        "vendor_id": "0x1FFFFFFFF",
        "mode": "speed",
        "rated_torque_nm": "100",
        "torque_limit_nm": "101",
        "inertia_kg_m2": "nan",
        "speed_rad_s": "-1",
    }
    with pytest.raises(UsageError) as refused:
        answers(VEHICLE | wrong, simulated=False)
    named = {line.split()[0].removeprefix("--").replace("-", "_") for line in str(refused.value).splitlines()}
    assert named == set(wrong) - {"node_m1", "rated_torque_nm"}


def test_a_file_that_is_there_stays(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "rig.toml"
    path.write_text("mine", encoding="utf-8")
    assert run(["rig", "new", str(path), "--simulated", "--yes"]) == 2
    assert "expected a new file" in capsys.readouterr().err
    assert path.read_text(encoding="utf-8") == "mine"
    assert list(tmp_path.iterdir()) == [path]


@pytest.fixture
def terminal(tmp_path: Path) -> Iterator[tuple[subprocess.Popen[bytes], int, Path]]:
    """``hil rig new`` at a real terminal: the process, the other end of it, and the file it is to write."""
    ours, theirs = pty.openpty()
    path = tmp_path / "rig.toml"
    process = subprocess.Popen(
        [sys.executable, "-m", "hil", "rig", "new", str(path)],
        stdin=theirs,
        stdout=theirs,
        stderr=theirs,
        preexec_fn=lambda: (os.setsid(), fcntl.ioctl(0, termios.TIOCSCTTY, 0)),  # Ctrl-C is then a key of it
    )
    os.close(theirs)
    yield process, ours, path
    if process.poll() is None:
        process.kill()
        process.wait()
    os.close(ours)


def read_until(end: int, text: str) -> str:
    """Read what the program prints until it has printed a text."""
    seen = ""
    while text not in seen:
        seen += os.read(end, 1024).decode()
    return seen


def test_a_person_at_a_terminal(terminal: tuple[subprocess.Popen[bytes], int, Path]) -> None:
    process, end, path = terminal
    for question in QUESTIONS:
        read_until(end, question.asks)
        if question.name == "node_m1":
            os.write(end, b"500\n")
            assert "expected a whole number from 1 to 127" in read_until(end, question.asks)
        os.write(end, f"{VEHICLE.get(question.name, '')}\n".encode())
    assert "written" in read_until(end, "hil check")
    assert process.wait(timeout=60) == 0
    assert read_rig(path).inverters.m2.torque_limit_nm == 90.0


def test_bus_nodes_period_and_mode_are_as_given(tmp_path: Path) -> None:
    path = tmp_path / "rig.toml"
    given = {"can": "socketcan:can1", "period_s": "0.02", "node_m1": "11", "node_m2": "12", "mode": "profile_torque"}
    assert run(["rig", "new", str(path), "--yes", *options(VEHICLE | given)]) == 0
    rig = read_rig(path)
    assert (rig.can.url, rig.period_s) == ("socketcan:can1", 0.02)
    assert (rig.inverters.m1.node_id, rig.inverters.m2.node_id) == (11, 12)
    assert {rig.inverters.m1.mode.name, rig.inverters.m2.mode.name} == {"PROFILE_TORQUE"}
