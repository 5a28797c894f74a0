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


def test_what_the_rig_file_gives_reaches_the_driver(tmp_path: Path) -> None:
    codes = "[inverters.m1.option_codes]\nabort_connection = 3\nquick_stop = 5\nfault_reaction = -1\n"
    path = with_keys(tmp_path, "rpdo_deadline_ms = 50", "torque_slope_nm_per_s = 900.0", tables=codes)
    rig = read_rig(path)
    settings = inverter_settings("m1", rig)
    assert (settings.rpdo_deadline_ms, settings.torque_slope_nm_per_s) == (50, 900.0)
    assert settings.option_codes == {0x6007: 3, 0x605A: 5, 0x605E: -1}
    assert rig.inverters.m2.option_codes.by_object == {}


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


def test_a_period_too_long_for_the_deadline_is_named_where_it_is_given(tmp_path: Path) -> None:
    deadline = (r"^# rpdo_deadline_ms = 150 ", "rpdo_deadline_ms = 200 ")
    path = changed(tmp_path, (r"^period_s = 0.01 ", "period_s = 0.15 "), deadline)
    problems = [line for line in problems_of(path) if "rpdo_deadline_ms" in line]
    assert [line.split(" | ")[0] for line in problems] == ["inverters.m1.rpdo_deadline_ms"]
