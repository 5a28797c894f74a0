"""How a drive is to stop by itself, as the rig file has it."""

from pathlib import Path

import pytest

from hil.config.rig_file import read_rig
from hil.rig.build import inverter_settings
from tests.config.test_rig_file import changed, problems_of

HEARTBEAT = r"(\[inverters\.m1\].*?heartbeat_ms = 100 [^\n]*\n)"


def with_keys(folder: Path, *lines: str, tables: str = "") -> Path:
    """The example with more keys for m1, and with a table after it."""
    return changed(
        folder, (HEARTBEAT, r"\1" + "\n".join(lines) + "\n"), (r"^\[inverters\.m2\]", f"{tables}\n[inverters.m2]")
    )


def test_without_a_word_the_eds_s_codes_count_and_the_deadline_is_150_ms(tmp_path: Path) -> None:
    settings = inverter_settings("m1", read_rig(changed(tmp_path)))
    assert (settings.rpdo_deadline_ms, settings.option_codes, settings.torque_slope_nm_per_s) == (150, {}, None)


def test_time_outs_are_each_drive_s_own(tmp_path: Path) -> None:
    rig = read_rig(with_keys(tmp_path, "sdo_timeout_s = 1.5", "mode_timeout_s = 8.0", "state_timeout_s = 4.0"))
    m1, m2 = inverter_settings("m1", rig), inverter_settings("m2", rig)
    assert (m1.sdo_timeout_s, m1.mode_timeout_s, m1.state_timeout_s) == (1.5, 8.0, 4.0)
    assert (m2.sdo_timeout_s, m2.mode_timeout_s, m2.state_timeout_s) == (0.5, 2.0, 2.0)


@pytest.mark.parametrize(
    ("lines", "tables", "problem"),
    [
        ((), "[inverters.m1.option_codes]\nabort_connection = 0\n", "m1.option_codes.abort_connection | expected gr"),
        ((), "[inverters.m1.option_codes]\nabort_connection = 4\n", "m1.option_codes.abort_connection | expected less"),
        ((), "[inverters.m1.option_codes]\nhalt = 40000\n", "m1.option_codes.halt | expected less"),
        ((), "[inverters.m1.option_codes]\nhalting = 1\n", "m1.option_codes.halting | expected"),
        (("rpdo_deadline_ms = 1",), "", "m1.rpdo_deadline_ms | expected greater"),
        (("rpdo_deadline_ms = 0.1",), "", "m1.rpdo_deadline_ms | expected a valid integer"),
        (("rpdo_deadline_ms = 15",), "", "m1.rpdo_deadline_ms | expected at least two periods (20), or one RPDO"),
        (("torque_slope_nm_per_s = 0.0",), "", "m1.torque_slope_nm_per_s | expected greater"),
        (("sdo_timeout_s = 0.0",), "", "m1.sdo_timeout_s | expected greater"),
        (("mode_timeout_s = 3600.0",), "", "m1.mode_timeout_s | expected less"),
        (('state_timeout_s = "2 s"',), "", "m1.state_timeout_s | expected a valid number"),
        (('accepted.rpdo_deadline = { by = "", why = "a relay" }',), "", "deadline.by | expected"),
    ],
)
def test_what_can_not_be_is_refused_by_its_key(
    lines: tuple[str, ...], tables: str, problem: str, tmp_path: Path
) -> None:
    [line] = problems_of(with_keys(tmp_path, *lines, tables=tables))
    assert problem in line


@pytest.mark.parametrize("key", ["guard_time_ms", "life_time_factor", "node_guarding"])
def test_node_guarding_is_refused_with_the_reason(key: str, tmp_path: Path) -> None:
    [line] = problems_of(with_keys(tmp_path, f"{key} = 100"))
    assert line.startswith(f"inverters.m1.{key} | expected no such key: node guarding needs remote frames")
    assert line.endswith("heartbeat_ms sets its period | got 100")
