"""The PLC's tables of a rig file: certificates on both sides or on none, and everything wrong named with its key."""

from pathlib import Path

import pytest

from drivers.plc.modbus_security import ClientSecurity, Credentials
from drivers.plc.register import Access
from hil.config.rig_file import read_rig
from hil.errors import RigFileError

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


def problems_of(path: Path) -> list[str]:
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
    (problem,) = problems_of(rig_file(tmp_path, more))
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
    assert any(line.startswith(problem) for line in problems_of(rig_file(tmp_path, wrong)))


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
        assert expected in problems_of(path)
