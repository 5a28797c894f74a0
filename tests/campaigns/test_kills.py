"""The campaign of kills in short: recordings of every format killed while they are written and published."""

from pathlib import Path

import pytest

from tests.campaigns.kills.__main__ import WRITABLE, campaign, report
from tests.campaigns.kills.recording import ROWS, Left, _judge, record


@pytest.mark.campaign
def test_kills_while_writing_and_publishing(tmp_path: Path) -> None:
    found = campaign(tmp_path, len(WRITABLE), seed=3)
    assert set(found) == set(WRITABLE)
    assert [problem for each in found.values() for left in each for problem in left.problems] == []
    assert {left.moment for each in found.values() for left in each} >= {"writing"}


class Unshared:
    """Progress that nobody looks at."""

    appended = written = ended = 0


@pytest.fixture
def whole(tmp_path: Path) -> Path:
    record(tmp_path / "run.csv", Unshared(), 20)
    return tmp_path / "run.csv"


def problems(path: Path, written: int) -> list[str]:
    left = Left("writing")
    _judge(path, written, written, left)
    return left.problems


def test_what_must_not_be_is_noticed(whole: Path) -> None:
    assert problems(whole, 20) == [f"run.csv has 20 rows of {ROWS}"]
    part = whole.rename(whole.with_name("run.part.csv"))
    whole.with_name("run.csv.json").unlink()
    assert problems(whole, 20) == []
    assert problems(whole, 21) == ["run.part.csv has 20 rows of 21"]
    part.write_text(part.read_text().replace("0.05,", "0.051,", 1))
    assert problems(whole, 20) == ["run.part.csv: column time_s is not what was recorded"]
    part.write_text(part.read_text()[:-40])
    assert "run.part.csv" in problems(whole, 20)[0]
    part.rename(whole.with_name("left"))
    assert problems(whole, 20) == ["nothing is left of 20 rows", "left is left"]


def test_the_table_says_how_many_were_wrong(capsys: pytest.CaptureFixture[str]) -> None:
    found = {".csv": [Left("writing", 10, 2), Left("publishing", 10, 0, ["damaged"]), Left("after", 10)]}
    assert report(found) == 1
    assert "| `.csv` | 3 | 1 | 1 | 1 | 2 | 1 |" in capsys.readouterr().out
    assert report({".csv": [Left("after", 10)]}) == 0
