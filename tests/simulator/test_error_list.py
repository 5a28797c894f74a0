"""Errors of a simulated drive: register, history and messages, by the frames of CiA 301."""

from __future__ import annotations

import pytest

from hil.simulator.drive_physics import ErrorList


@pytest.mark.parametrize(
    ("code", "register"),
    [(0x2310, 0x03), (0x3220, 0x05), (0x4310, 0x09), (0x8130, 0x11), (0x8250, 0x11), (0x7303, 0x01), (0x5441, 0x21)],
)
def test_the_register_tells_the_class(code: int, register: int) -> None:
    errors = ErrorList()
    errors.set(code)
    assert errors.register == register
    [emergency] = errors.take_due()
    assert (emergency.code, emergency.register) == (code, register)


def test_an_error_is_reported_once_and_its_end_when_all_are_gone() -> None:
    errors = ErrorList()
    for code in (0x8130, 0x8130, 0x4310):
        errors.set(code)
    errors.clear(0x8130)
    assert [each.code for each in errors.take_due()] == [0x8130, 0x4310]
    errors.clear()
    errors.clear()
    assert [(each.code, each.register) for each in errors.take_due()] == [(0, 0)]
    assert errors.take_due() == []


def test_the_history_has_the_newest_first_and_outlives_the_errors() -> None:
    errors = ErrorList()
    for code in (0x1000, 0x2310, 0x3220, 0x4310, 0x8130):
        errors.set(code)
    errors.clear()
    assert [errors.history(n) for n in range(6)] == [4, 0x8130, 0x4310, 0x3220, 0x2310, 0]
    errors.forget_history()
    assert [errors.history(n) for n in range(2)] == [0, 0]
