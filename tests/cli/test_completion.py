"""``hil completion``: the scripts in the shells themselves."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable, Iterable
from pathlib import Path

import pytest

from estimator.physics.catalogue import EFFECTS
from hil.cli.main import COMMANDS, run

RIG = Path(__file__).resolve().parents[2] / "examples" / "rig.toml"

Complete = Callable[[str], set[str]]

BASH = 'source {script}; COMP_WORDS=({words} {last}); COMP_CWORD={place}; _hil; printf "%s\\n" "${{COMPREPLY[@]}}"'

ZSH = """compadd() {{ shift; print -l -- ${{(M)@:#{last}*}}; }}; _files() {{ print FILES; }}; compdef() {{ :; }}
source {script}; words=({words} {last}); CURRENT={place}+1; _hil"""


def _bash(script: Path, line: str) -> list[str]:
    words = line.split(" ")
    body = BASH.format(
        script=script, words=" ".join(f"'{word}'" for word in words[:-1]), last=f"'{words[-1]}'", place=len(words) - 1
    )
    return ["bash", "--noprofile", "--norc", "-c", body]


def _zsh(script: Path, line: str) -> list[str]:
    words = line.split(" ")
    last = words[-1] or "''"
    body = ZSH.format(script=script, words=" ".join(words[:-1]), last=last, place=len(words) - 1)
    return ["zsh", "-f", "-c", body]


def _fish(script: Path, line: str) -> list[str]:
    return ["fish", "--no-config", "-c", f"source {script}; complete -C '{line}' | string replace -r '\\t.*' ''"]


SHELLS = {"bash": _bash, "zsh": _zsh, "fish": _fish}


@pytest.fixture(scope="module")
def scripts(tmp_path_factory: pytest.TempPathFactory) -> Path:
    from hil.support.completion import script

    folder = tmp_path_factory.mktemp("scripts")
    for shell in SHELLS:
        (folder / shell).write_text(script(shell, COMMANDS, EFFECTS), encoding="utf-8")
    return folder


@pytest.fixture(params=SHELLS)
def complete(request: pytest.FixtureRequest, scripts: Path) -> Complete:
    """Complete a line as a shell does; its last word is the one begun."""
    shell: str = request.param
    if shutil.which(shell) is None:
        pytest.skip(f"{shell} is not installed here")

    def ask(line: str) -> set[str]:
        command = SHELLS[shell](scripts / shell, line)
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert done.stderr == ""
        return set(done.stdout.split())

    return ask


def offered(found: Iterable[str], begun: str) -> set[str]:
    return {name for name in found if name.startswith(begun)}


def test_commands(complete: Complete) -> None:
    assert complete("hil ") >= set(COMMANDS)
    assert complete("hil re") == offered(COMMANDS, "re")
    assert complete("hil --quiet re") == offered(COMMANDS, "re")
    assert complete("hil prove ma") == {"make"}


def test_options(complete: Complete) -> None:
    assert {"--dry-run", "--out", "--quiet", "--help"} <= complete("hil run --")
    assert complete("hil run --dr") == {"--dry-run"}
    assert complete("hil export st --si") == {"--single"}
    assert complete("hil --log-level d") == {"debug"}
    assert complete("hil run --pace f") == {"fast"}


def test_effects(complete: Complete) -> None:
    assert complete("hil effects bac") == offered(EFFECTS, "bac")
    assert complete("hil sim rig.toml --effect sti") == offered(EFFECTS, "sti")


def test_experiments_of_the_rig_file_on_the_line(complete: Complete) -> None:
    assert {"cruise", "reversal", "tip"} <= complete(f"hil run {RIG} ")
    assert complete(f"hil run {RIG} c") == {"cruise"}
    assert complete(f"hil run --pace fast {RIG} re") == {"reversal"}


def test_the_command_prints_the_script(scripts: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["completion", "bash"]) == 0
    assert capsys.readouterr().out == (scripts / "bash").read_text(encoding="utf-8")


def test_another_shell_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["completion", "tcsh"]) == 2
    assert "bash" in capsys.readouterr().err
