"""The page about the tests names tests that there are, and a reason for each."""

import re

from tests.docs.pages import DOCS, ROOT

ROW = re.compile(r"^\| (?P<seconds>\d+) \| `(?P<file>\S+)` \| `(?P<test>\w+)`[^|]* \| (?P<why>\w[^|]+) \|$", re.M)


def test_each_of_the_slowest_twenty_is_there_and_justified() -> None:
    rows = list(ROW.finditer((DOCS / "testing.md").read_text(encoding="utf-8")))
    assert len(rows) == 20
    for row in rows:
        assert f"def {row['test']}(" in (ROOT / "tests" / row["file"]).read_text(encoding="utf-8")
    seconds = [int(row["seconds"]) for row in rows]
    assert seconds == sorted(seconds, reverse=True)
