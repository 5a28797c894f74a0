"""What every command has: --quiet, --log-level, the overview; before the command or after it."""

import subprocess
import sys

import pytest

from hil.cli.command_line import COMMANDS, Call, overview
from hil.cli.main import run
from hil.errors import UsageError


@pytest.mark.parametrize(
    "line",
    [
        "--quiet --log-level debug run rig.toml cruise",
        "run --quiet rig.toml --log-level debug cruise",
        "run rig.toml cruise --log-level=debug --quiet",
    ],
)
def test_common_options_stand_anywhere(line: str) -> None:
    assert Call.parse(line.split(), COMMANDS) == Call("run", ("rig.toml", "cruise"), True, "debug")


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("--log-level", "requires an argument"),
        ("effects --log-level", "requires an argument"),
        ("effect", "Did you mean 'effects'"),
        ("-q effects", "No such option: -q"),
    ],
)
def test_wrong_use_is_refused(line: str, said: str) -> None:
    with pytest.raises(UsageError, match=said):
        Call.parse(line.split(), COMMANDS)


def test_quiet_prints_nothing_but_what_json_prints(capsys: pytest.CaptureFixture[str], tmp_path: object) -> None:
    assert run(["export", "st", "--adaptive", "--out", f"{tmp_path}/a.st", "--quiet"]) == 0
    assert capsys.readouterr() == ("", "")
    assert Call("diagnose", ("--json",), quiet=True).silent is False
    assert Call("diagnose", (), quiet=True).silent is True


@pytest.mark.parametrize("columns", [40, 80, 200])
def test_the_overview_fits_the_terminal(columns: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", str(columns))
    text = overview(COMMANDS)
    assert max(map(len, text.splitlines())) <= columns
    assert all(f"  {name} " in text for name in COMMANDS)


def test_the_overview_imports_nothing_that_takes_time() -> None:
    program = (
        "import sys; from hil.cli.main import run; run(['--help']); "
        "print(sorted({'typer', 'rich', 'numpy', 'pydantic', 'logging', 'can'} & set(sys.modules)), file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stderr.strip() == "[]"
