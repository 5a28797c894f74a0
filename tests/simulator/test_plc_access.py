"""What a role may do with the simulated PLC."""

from __future__ import annotations

from pathlib import Path

import pytest

from drivers.plc.modbus_security import Credentials
from drivers.plc.register import Access
from hil.simulator.plc_server import PlcSecurity

NO_FILES = Credentials(Path("ca"), Path("certificate"), Path("key"))
SECURITY = PlcSecurity(NO_FILES, {"viewer": Access.READ, "operator": Access.READ_WRITE})
READING, WRITING = (1, 2, 3, 4), (5, 6, 15, 16)
UNKNOWN = (0, 7, 22, 23, 43, 100, 255)


@pytest.mark.parametrize("function_code", READING)
def test_reading(function_code: int) -> None:
    assert SECURITY.allows("viewer", function_code)
    assert SECURITY.allows("operator", function_code)


@pytest.mark.parametrize("function_code", WRITING + UNKNOWN)
def test_everything_else_counts_as_writing(function_code: int) -> None:
    assert not SECURITY.allows("viewer", function_code)
    assert SECURITY.allows("operator", function_code)


@pytest.mark.parametrize("role", [None, "", "nobody", "Operator", "operator "])
@pytest.mark.parametrize("function_code", READING + WRITING)
def test_no_role_and_an_unknown_one_may_do_nothing(role: str | None, function_code: int) -> None:
    assert not SECURITY.allows(role, function_code)
