"""``hil prove``: from the making of a sealed set to its scoreboard, by the public command alone."""

import json
import re
from collections.abc import Sequence
from contextlib import chdir
from pathlib import Path

import pytest

from hil.cli.main import run
from hil.proof import answers, command
from tests.proof.conftest import recordings_of

SEED = "4"
"""Of a set whose first case is quickly answered."""


def test_a_set_is_made_answered_opened_and_scored(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def in_this_process(arguments: Sequence[str], folder: Path, limit_s: float) -> None:
        with chdir(folder):
            assert run(list(arguments)) == 0

    for module in (answers, command):  # its own process, which starts anew, is tried in test_trusted_code
        monkeypatch.setattr(module, "run_hil", in_this_process)
    out, key = tmp_path / "proof", tmp_path / "proof.key"
    with recordings_of(1000):
        assert run(["prove", "--out", str(out), "--cases", "1", "--seed", SEED, "--no-rigs"]) == 0
    said = capsys.readouterr().out
    assert re.search(r"digest: [0-9a-f]{64}", said)
    data = json.loads((out / "scoreboard.json").read_text())
    assert [case["case"] for case in data["cases"]] == ["case_001"]
    assert data["cases"][0]["fault"] is None
    assert (out / "verdicts" / "case_001" / "report.html").is_file()
    assert "Scoreboard" in (out / "scoreboard.html").read_text()
    assert key.stat().st_mode & 0o077 == 0  # nobody else can read it
    assert not list(out.rglob("*.key"))
    assert run(["prove", "--out", str(out), "--no-rigs"]) == 0  # continues: nothing is left to do
    again = json.loads((out / "scoreboard.json").read_text())
    assert {**again, "made": data["made"]} == data
    digest = re.findall(r"digest: ([0-9a-f]{64})", said)[-1]
    opened = ["prove", "open", str(out), "--key-file", str(key), "--verdicts"]
    assert run([*opened, digest]) == 0
    capsys.readouterr()
    assert run([*opened, "0" * 64]) == 2  # verdicts that were replaced after their digest had been kept
    assert "expected the verdicts of digest 000" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "wanted"),
    [
        (["open", "DIR"], "expected the key once"),
        (["open", "DIR", "--key", "12"], "expected the 64 hexadecimal digits"),
        (["run", "DIR"], "hil prove make DIR makes one"),
        (["make", "DIR", "--key-file", "DIR/key"], "expected a file outside"),
        (["make", "DIR", "--cases", "0"], "cases"),
    ],
)
def test_wrong_use_is_refused_with_what_was_expected(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], wanted: str
) -> None:
    folder = str(tmp_path / "set")
    assert run(["prove", *(text.replace("DIR", folder) for text in arguments)]) == 2
    assert wanted in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_the_key_of_another_set_is_not_overwritten(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    key = tmp_path / "mine.key"
    key.write_text("mine")
    assert run(["prove", "make", str(tmp_path / "set"), "--key-file", str(key)]) == 2
    assert "not there yet" in capsys.readouterr().err
    assert key.read_text() == "mine"


@pytest.mark.campaign
@pytest.mark.timeout(1800)  # eight rigs, each driven and diagnosed
def test_what_is_concealed_in_the_rigs_is_found_over_the_wire(tmp_path: Path) -> None:
    assert run(["prove", "wire", str(tmp_path)]) == 0
    rigs = json.loads((tmp_path / "wire" / "wire.json").read_text())["rigs"]
    assert [rig["case"] for rig in rigs if not rig["success"]] == []
