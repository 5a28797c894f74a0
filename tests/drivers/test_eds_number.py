"""Numbers and values as an EDS writes them."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.datasheet.types import DATA_TYPES, DataType, Formula, read_formula, read_number

INTEGERS = [kind for kind in DATA_TYPES.values() if kind.is_integer]


@pytest.mark.parametrize(
    ("text", "number"),
    [
        ("0", 0),
        ("16", 16),
        ("0x10", 16),
        ("0X1f", 31),
        ("020", 16),
        ("00", 0),
        ("-1", -1),
        (" 7 ", 7),
        ("08", None),
        ("0x", None),
        ("", None),
        ("1.0", None),
        ("10h", None),
        ("1_000", None),
        ("０", None),
    ],
)
def test_number(text: str, number: int | None) -> None:
    assert read_number(text) == number


@given(st.integers(-(1 << 63), 1 << 64))
def test_every_number_is_read_back_from_all_three_ways_to_write_it(number: int) -> None:
    sign, size = ("-" if number < 0 else ""), abs(number)
    assert {read_number(f"{sign}{text}") for text in (f"{size}", f"0x{size:X}", f"0{size:o}")} == {number}


@pytest.mark.parametrize(
    ("text", "formula"),
    [
        ("$NODEID+0x180", Formula(0x180, of_node_id=True, node_id_first=True, hexadecimal=True)),
        ("$NODEID + 384", Formula(384, of_node_id=True, node_id_first=True)),
        ("0x180+$NodeId", Formula(0x180, of_node_id=True, hexadecimal=True)),
        ("$NODEID", Formula(0, of_node_id=True, node_id_first=True)),
        ("0x80000000+$NODEID+0x180", Formula(0x80000180, of_node_id=True, hexadecimal=True)),
        ("12", Formula(12)),
        ("$NODEID+$NODEID", None),
        ("$NODEID-1", None),
        ("$NODEID+", None),
        ("$NODE+1", None),
        ("", None),
    ],
)
def test_formula(text: str, formula: Formula | None) -> None:
    assert read_formula(text) == formula
    if formula is not None:
        assert formula.value(5) - formula.value(0) == (5 if formula.of_node_id else 0)


@pytest.mark.parametrize("kind", INTEGERS, ids=lambda kind: kind.name)
def test_integer_is_taken_up_to_the_ends_of_its_type_and_no_further(kind: DataType) -> None:
    for value in (kind.low, kind.high):
        assert kind.integer(str(value), 1) == value
    for value in (kind.low - 1, kind.high + 1):
        assert kind.integer(str(value), 1) is None


@pytest.mark.parametrize(("text", "value"), [("0xFFFF", -1), ("0x8000", -32768), ("0x7FFF", 32767), ("0x10000", None)])
def test_hexadecimal_number_is_the_bit_pattern(text: str, value: int | None) -> None:
    assert DATA_TYPES[0x03].integer(text, 1) == value
