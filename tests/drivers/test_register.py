"""One register: values to words and back, and what must not pass either way."""

import math
import struct

import pytest
from hypothesis import given, settings, strategies as st

from drivers.errors import ConfigMismatch, ProtocolViolation
from drivers.plc.register import Access, Register, RegisterKind, Value, ValueType, WordOrder


def register(
    value_type: ValueType,
    *,
    kind: RegisterKind = RegisterKind.HOLDING_REGISTER,
    word_order: WordOrder | None = None,
    scale: float | None = None,
    values: dict[str, int] | None = None,
) -> Register:
    return Register(
        kind=kind,
        address=10,
        type=value_type,
        access=Access.READ,
        unit="Nm",
        description="Under test.",
        word_order=word_order,
        scale=scale,
        values=values,
    )


HIGH, LOW = WordOrder.HIGH_WORD_FIRST, WordOrder.LOW_WORD_FIRST
COIL = register(ValueType.BOOL, kind=RegisterKind.COIL)
ENUM = register(ValueType.ENUM, values={"open": 0, "closed": 3})
SCALED = register(ValueType.INT16, scale=0.1)
FLOAT = register(ValueType.FLOAT32, word_order=LOW)


@pytest.mark.parametrize(
    ("entry", "value", "words"),
    [
        (COIL, True, (1,)),
        (COIL, False, (0,)),
        (register(ValueType.UINT16), 65535, (0xFFFF,)),
        (register(ValueType.INT16), -2, (0xFFFE,)),
        (register(ValueType.UINT32, word_order=HIGH), 0x12345678, (0x1234, 0x5678)),
        (register(ValueType.UINT32, word_order=LOW), 0x12345678, (0x5678, 0x1234)),
        (register(ValueType.INT32, word_order=HIGH), -2, (0xFFFF, 0xFFFE)),
        (register(ValueType.FLOAT32, word_order=HIGH), 1.0, (0x3F80, 0x0000)),  # IEEE 754: 1.0 is 3F800000
        (FLOAT, -2.0, (0x0000, 0xC000)),
        (ENUM, "closed", (3,)),
        (SCALED, -12.5, (0x10000 - 125,)),
    ],
)
def test_known_words(entry: Register, value: Value, words: tuple[int, ...]) -> None:
    assert entry.encode(value) == words
    assert entry.decode(words) == value
    assert type(entry.decode(words)) is type(value)


@pytest.mark.parametrize(
    ("entry", "value", "expected"),
    [
        (COIL, 1, "True or False"),
        (register(ValueType.UINT16), -1, "a number that fits uint16"),
        (register(ValueType.UINT16), 65536, "a number that fits uint16"),
        (register(ValueType.INT16), 40000, "a number that fits int16"),
        (register(ValueType.INT32, word_order=HIGH), 2**31, "a number that fits int32"),
        (register(ValueType.UINT16), 1.5, "a whole number"),
        (register(ValueType.UINT16), True, "a finite number"),
        (register(ValueType.UINT16), "5", "a finite number"),
        (SCALED, 3276.8, "a number that fits int16 in steps of 0.1 Nm"),
        (SCALED, math.nan, "a finite number"),
        (register(ValueType.UINT16, scale=1e-300), 1e300, "a number that fits uint16"),
        (FLOAT, math.inf, "a finite number"),
        (FLOAT, 1e39, "a number that fits float32"),
        (ENUM, "ajar", "one of open, closed"),
        (ENUM, 3, "one of open, closed"),
    ],
)
def test_what_does_not_fit_is_refused(entry: Register, value: Value, expected: str) -> None:
    with pytest.raises(ConfigMismatch, match=f"10 \\(Under test\\): expected {expected}.*got"):
        entry.encode(value)


@pytest.mark.parametrize(
    ("entry", "words", "expected"),
    [
        (ENUM, (1,), "one of"),
        (FLOAT, (0x0000, 0x7FC0), "a finite number, got nan"),
        (FLOAT, (0x0000, 0x7F80), "a finite number, got inf"),
        (FLOAT, (0x0000,), r"2 word\(s\), got 1"),
        (COIL, (), r"1 word\(s\), got 0"),
    ],
)
def test_words_that_mean_nothing_are_refused(entry: Register, words: tuple[int, ...], expected: str) -> None:
    with pytest.raises(ProtocolViolation, match=f"expected {expected}"):
        entry.decode(words)


@settings(derandomize=True)
@given(st.floats(width=32, allow_nan=False, allow_infinity=False), st.sampled_from(WordOrder))
def test_floats_come_back_bit_for_bit(value: float, order: WordOrder) -> None:
    entry = register(ValueType.FLOAT32, word_order=order)
    back = entry.decode(entry.encode(value))
    assert isinstance(back, float)
    assert struct.pack(">d", back) == struct.pack(">d", value)


@settings(derandomize=True)
@given(st.floats(-3276.8, 3276.7))
def test_a_scaled_value_comes_back_within_half_a_step(value: float) -> None:
    back = SCALED.decode(SCALED.encode(value))
    assert isinstance(back, float)
    assert abs(back - value) <= 0.05 + 1e-9
