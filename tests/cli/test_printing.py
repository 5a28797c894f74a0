"""Whatever a stranger's file says, no control character of it reaches the terminal."""

import io
import re
from pathlib import Path

import numpy as np
import pytest

import hil.cli
from hil.cli.main import run
from hil.cli.printing import new_console
from hil.printable import shown
from hil.recording import Table, write_table
from hil.store import RunStore, register_run

EVIL = "a\x1b]0;owned\x07\x9b31m\u202eb\x00\r"


def test_control_characters_are_shown() -> None:
    assert shown(EVIL) == "a\\x1b]0;owned\\x07\\x9b31m\\u202eb\\x00\\x0d"
    assert shown("Größe\t1\xa0s\n") == "Größe\t1\xa0s\n"


def test_a_console_shows_them_in_tables() -> None:
    from rich.table import Table as Columns

    out = io.StringIO()
    table = Columns("x")
    table.add_row(EVIL)
    new_console(file=out, width=100).print(table)
    assert not re.search("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202e]", out.getvalue())


def test_no_command_prints_what_a_store_says_as_it_is(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    said = {"schema": "hil.recording/1", "experiment": EVIL, "rig_file": f"# {EVIL}", "pace": EVIL}
    columns = {"time_s": 0.1 * np.arange(5), "speed_rad_s": np.ones(5)}
    for name in ("a.csv", "b.csv"):
        write_table(Table(tmp_path / name, columns, {"time_s": "s"}, {**said, "x": name}), tmp_path / name)
        register_run(tmp_path / name, f"{EVIL} {name}")
    with RunStore(tmp_path) as store:
        store.note(1, EVIL)
        store.attach(1, EVIL, "{}")
        store.attach(1, "diagnosis", {"verdict": EVIL, "parameters": {EVIL: {"unit": EVIL, "value": EVIL}}})
    for line in (["runs"], ["runs", "show", "1"], ["runs", "compare", "1", "2", "--all"], ["runs", "show", EVIL]):
        run([*line, *(["--store", str(tmp_path)])])
        out = capsys.readouterr()
        assert not re.search("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202e]", out.out + out.err)


def test_commands_print_in_one_way() -> None:
    """`hil diagnose` is still to follow."""
    others = []
    for path in Path(hil.cli.__file__).parent.rglob("*.py"):
        if path.name not in ("printing.py", "diagnose.py") and re.search(
            r"typer\.echo\(|\bConsole\(", path.read_text()
        ):
            others.append(path.name)
    assert others == []
