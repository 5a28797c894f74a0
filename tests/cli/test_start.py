"""What takes a second to import stays out of the way of commands that do not need it."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.chosen import campaign

SCIPY = ("scipy.interpolate", "scipy.linalg", "scipy.optimize", "scipy.signal", "scipy.special", "scipy.stats")
OF_FILES = ("asammdf", "h5py", "matplotlib", "pandas", "plotly", "pyarrow")
SLOW = (*SCIPY, *OF_FILES, "textual", "dask", "distributed", "fsspec")
RIG = str(Path(__file__).parents[2] / "examples" / "rig.toml")
NOBODY = "ws://127.0.0.1:1/"

BUS_COMMANDS = {
    "run": (["run", RIG, "cruise", "--out", "run.parquet", "--bus", NOBODY], SLOW),
    "run without an estimate": (
        ["run", RIG, "cruise", "--out", "run.csv", "--no-estimate", "--bus", NOBODY],
        (*SLOW, "numba"),
    ),
    "check": (["check", RIG, "--bus", NOBODY], (*SLOW, "numba")),
    "commission": (["commission", RIG, "--out", "job", "--yes", "--bus", NOBODY], SLOW),
    "sim": (["sim", RIG, "--bus", "ws://127.0.0.1:0/", "--modbus", "127.0.0.1:0"], SLOW),
}
"""Command lines, and what each has not imported when it first turns to the bus."""

AT_THE_BUS = """
import json, os, sys

def look(event, arguments):
    if event in ("socket.connect", "socket.bind"):
        with open("modules.json", "w") as file:
            json.dump(list(sys.modules), file)
        os._exit(0)

sys.addaudithook(look)
from hil.cli.main import run
sys.exit(f"no bus was opened: status {run(sys.argv[1:])}")
"""


@pytest.mark.parametrize(
    ("modules", "absent"),
    [
        ("hil.cli.main, hil.cli.command_line", (*SLOW, "can", "numba", "numpy", "pydantic", "rich", "scipy", "typer")),
        campaign(("hil.monitor.host", SLOW)),
        campaign(("hil.monitor.opening", (*OF_FILES, "scipy.signal", "scipy.stats", "textual"))),
        ("hil.monitor.opening, hil.monitor.app", (*OF_FILES, "scipy.signal", "scipy.stats")),
    ],
    ids=["help", "monitor: process of the rig", "monitor: before that is started", "monitor: process of the view"],
)
def test_what_is_not_needed_is_not_imported(modules: str, absent: tuple[str, ...]) -> None:
    program = f"import sys, {modules}; print(*(name for name in {absent} if name in sys.modules))"
    done = subprocess.run([sys.executable, "-P", "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []


@pytest.mark.parametrize(
    "command",
    [
        pytest.param(name, marks=() if name == "run without an estimate" else pytest.mark.campaign)
        for name in BUS_COMMANDS
    ],
)
def test_what_is_not_needed_is_not_imported_before_the_bus_is_opened(command: str, tmp_path: Path) -> None:
    line, absent = BUS_COMMANDS[command]
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1"}  # imported all the same, and nothing has to be compiled
    done = subprocess.run(
        [sys.executable, "-P", "-c", AT_THE_BUS, *line],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        env=environment,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert sorted(set(absent) & set(json.loads((tmp_path / "modules.json").read_text()))) == []
