"""A rig for the monitor: the example's, with a cruise at standstill and patience for a busy test machine."""

from pathlib import Path

import pytest

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "rig.toml"


@pytest.fixture
def rig_path(tmp_path: Path) -> Path:
    """Write the rig file."""
    text = EXAMPLE.read_text(encoding="utf-8")
    for before, after in (
        ("speed_rad_s = 60.0", "speed_rad_s = 0.0"),
        ("feedback_timeout_s = 0.2", "feedback_timeout_s = 3.0"),
    ):
        assert text.count(before) == 1
        text = text.replace(before, after)
    path = tmp_path / "rig.toml"
    path.write_text(text, encoding="utf-8")
    return path
