"""How a drive is to stop by itself, as the rig file has it."""

from pathlib import Path

import pytest

from drivers.plc.modbus_security import ClientSecurity, Credentials
from drivers.plc.register import Access
from hil.config.rig_file import read_rig
from hil.errors import RigFileError
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


EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "rig.toml"

HOST = '[plc.security]\nca = "ca.pem"\ncertificate = "host.pem"\nkey = "host.key"\n'
PLC = '[simulation.plc_security]\nca = "ca.pem"\ncertificate = "plc.pem"\nkey = "plc.key"\n'
ROLES = 'roles = { operator = "read_write", viewer = "read" }\n'
FILES = ("ca.pem", "host.pem", "host.key", "plc.pem", "plc.key")


def rig_file(folder: Path, more: str) -> Path:
    for name in FILES:
        (folder / name).touch()
    path = folder / "rig.toml"
    path.write_text(f"{EXAMPLE.read_text('utf-8')}\n{more}", "utf-8")
    return path


def plc_problems_of(path: Path) -> list[str]:
    with pytest.raises(RigFileError) as refusal:
        read_rig(path)
    return list(refusal.value.problems)


def test_both_sides(tmp_path: Path) -> None:
    rig = read_rig(rig_file(tmp_path, HOST + 'server_name = "plc.test"\n' + PLC + ROLES))
    assert rig.plc.security is not None
    expected = Credentials(tmp_path / "ca.pem", tmp_path / "host.pem", tmp_path / "host.key")
    assert rig.plc.security.client == ClientSecurity(expected, "plc.test")
    assert rig.simulation is not None
    assert rig.simulation.plc_security is not None
    assert rig.simulation.plc_security.roles == {"operator": Access.READ_WRITE, "viewer": Access.READ}
    assert rig.simulation.plc_security.credentials.certificate == tmp_path / "plc.pem"


@pytest.mark.parametrize(("more", "got"), [(HOST, "None"), (PLC + ROLES, "a table")])
def test_one_side_alone_is_refused(more: str, got: str, tmp_path: Path) -> None:
    (problem,) = plc_problems_of(rig_file(tmp_path, more))
    assert problem.startswith("simulation.plc_security | expected this table if and only if there is [plc.security]")
    assert problem.endswith(f"| got {got}")


@pytest.mark.parametrize(
    ("wrong", "problem"),
    [
        (HOST.replace("host.pem", "gone.pem"), "plc.security.certificate | expected an existing file, looked for "),
        (HOST.replace('key = "host.key"\n', ""), "plc.security.key | expected this key | got nothing: add it"),
        (HOST + 'server_name = ""\n', "plc.security.server_name | expected"),
        (HOST + 'password = "x"\n', "plc.security.password | expected one of the known keys (ca, certificate, key, se"),
        (PLC, "simulation.plc_security.roles | expected this key | got nothing: add it"),
        (PLC + "roles = {}\n", "simulation.plc_security.roles | expected"),
        (
            PLC + 'roles = { viewer = "write" }\n',
            "simulation.plc_security.roles.viewer | expected 'read' or 'read_write'",
        ),
    ],
)
def test_a_wrong_key_is_named(wrong: str, problem: str, tmp_path: Path) -> None:
    assert any(line.startswith(problem) for line in plc_problems_of(rig_file(tmp_path, wrong)))


@pytest.mark.parametrize(
    ("amplitude_nm", "of"), [(240.0, None), (700.0, "guard.sum_limit_nm"), (900.0, "inverters.m1.torque_limit_nm")]
)
def test_a_prbs_of_the_plc_must_leave_the_guard_some_room(amplitude_nm: float, of: str | None, tmp_path: Path) -> None:
    text = EXAMPLE.read_text("utf-8").partition("[experiments.cruise]")[0]
    text = text.replace("amplitude_nm = 120.0", f"amplitude_nm = {amplitude_nm}").replace('"host"', '"plc"', 1)
    text = text.replace("prbs_limit_nm = 120.0", "prbs_limit_nm = 1000.0")
    path = tmp_path / "rig.toml"
    path.write_text(text, "utf-8")
    if of is None:
        assert read_rig(path).guard_limits.sum_limit_nm == 700.0 - amplitude_nm
    else:
        expected = f"prbs.amplitude_nm | expected less than {of} allows, since source is 'plc' | got {amplitude_nm}"
        assert expected in plc_problems_of(path)
