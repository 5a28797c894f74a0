"""The campaign of a day, for half a minute of it."""

import pytest

from tests.campaigns import day


@pytest.mark.campaign
def test_half_a_minute_of_a_day(capsys: pytest.CaptureFixture[str]) -> None:
    assert day.main(["--hours", "0.01"]) == 0
    assert "| published, 3600 rows: at most |" in capsys.readouterr().out
