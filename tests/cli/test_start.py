"""What takes a second to import stays out of the way of commands that do not need it."""

from __future__ import annotations

import subprocess
import sys

import pytest

SLOW = ("asammdf", "pandas", "scipy.signal", "scipy.stats", "plotly", "textual", "matplotlib")


@pytest.mark.parametrize(
    ("modules", "also"),
    [
        ("hil.cli.main, hil.cli.overview", ("can", "numba", "numpy", "pydantic", "rich", "typer")),
        ("hil.cli.check, hil.rig.check, hil.rig.build", ("numba",)),
        ("hil.cli.run.job, hil.cli.run.live, hil.rig.live, hil.rig.build, hil.rig.session", ()),
    ],
    ids=["help", "check", "run"],
)
def test_what_a_command_needs_not(modules: str, also: tuple[str, ...]) -> None:
    program = f"import sys, {modules}; print(*(name for name in {(*SLOW, *also)} if name in sys.modules))"
    done = subprocess.run([sys.executable, "-P", "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []


def test_python_can_is_whole_but_for_the_format_that_is_not_used() -> None:
    program = "import drivers.canopen, can, sys; print(can.__version__, 'asammdf' in sys.modules); import asammdf"
    done = subprocess.run([sys.executable, "-P", "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.split()[1] == "False"
