"""What has not passed the guard does not type-check."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

OPENING = """
from drivers.torque_guard import Evidence, GuardedTorque, TorqueGuard, TorqueRequest

def send(torque: GuardedTorque) -> None: ...

def run(guard: TorqueGuard, request: TorqueRequest) -> None:
"""


@pytest.fixture(scope="module")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("mypy_cache")


def type_check(line: str, folder: Path, cache: Path) -> str:
    program = folder / "program.py"
    program.write_text(f"{OPENING}    {line}\n")
    command = [sys.executable, "-m", "mypy", "--config-file=", "--strict", f"--cache-dir={cache}", str(program)]
    environment = {**os.environ, "MYPYPATH": str(ROOT)}
    return subprocess.run(command, capture_output=True, text=True, env=environment, check=False).stdout


def test_what_the_guard_returns_type_checks(tmp_path: Path, cache: Path) -> None:
    assert "Success" in type_check("send(guard.check(request, 0, Evidence(0, 0, 0.0))[0])", tmp_path, cache)


@pytest.mark.parametrize(
    ("line", "complaint"),
    [
        ("send(12.0)", 'incompatible type "float"'),
        ("send(request)", 'incompatible type "TorqueRequest"'),
        ("send(GuardedTorque(12.0, 0.0))", 'Missing positional argument "seal"'),
        ("send(GuardedTorque(12.0, 0.0, object()))", 'incompatible type "object"; expected "_Seal"'),
        ("guard.zero()[0].base_nm = 12.0", "is read-only"),
    ],
)
def test_a_way_round_the_guard_does_not(line: str, complaint: str, tmp_path: Path, cache: Path) -> None:
    assert complaint in type_check(line, tmp_path, cache)
