"""PDO layouts and frames: packed at the limits, refused beyond, compared with the objects they come from."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.canopen.pdo_map import MappedObject, PdoCodec, PdoLayout, configuration_writes, read_layout
from drivers.errors import CommandRefused, ConfigMismatch, ProtocolViolation
from drivers.scaling import IntegerType

TYPES = {
    (0x6041, 0): IntegerType.UNSIGNED16,
    (0x6077, 0): IntegerType.INTEGER16,
    (0x606C, 0): IntegerType.INTEGER32,
    (0x6061, 0): IntegerType.INTEGER8,
}
TPDO = PdoLayout(
    0x1800,
    0x1A00,
    0x185,
    valid=True,
    transmission_type=1,
    objects=(MappedObject(0x6041, 0, 16), MappedObject(0x6077, 0, 16), MappedObject(0x606C, 0, 32)),
)


def codec(*objects: MappedObject) -> PdoCodec:
    return PdoCodec(PdoLayout(0x1800, 0x1A00, 0x185, True, 1, objects or TPDO.objects), TYPES, "node 5")


def test_frame_is_little_endian_in_mapping_order() -> None:
    data = codec().pack((0x0637, -2, 0x01020304))
    assert data == bytes.fromhex("37 06 fe ff 04 03 02 01")
    assert codec().unpack(data) == (0x0637, -2, 0x01020304)


@given(st.integers(0, 0xFFFF), st.integers(-32768, 32767), st.integers(-(2**31), 2**31 - 1))
def test_every_value_survives_the_frame(statusword: int, torque: int, speed: int) -> None:
    values = (statusword, torque, speed)
    assert codec().unpack(codec().pack(values)) == values


@pytest.mark.parametrize(
    "values", [(-1, 0, 0), (0x10000, 0, 0), (0, 32768, 0), (0, -32769, 0), (0, 0, 2**31), (0, 0), (0, 0, 0, 0)]
)
def test_values_that_do_not_fit_are_refused(values: tuple[int, ...]) -> None:
    with pytest.raises(CommandRefused, match=r"node 5: PDO 0x1800 .* do not fit the objects"):
        codec().pack(values)


@pytest.mark.parametrize("length", [0, 7, 9])
def test_frame_of_another_length_is_refused(length: int) -> None:
    with pytest.raises(ProtocolViolation, match=f"frame of {length} bytes, expected 8"):
        codec().unpack(bytes(length))


@pytest.mark.parametrize(
    ("mapped", "expected"),
    [
        (MappedObject(0x6062, 0, 32), "an integer object of the EDS"),
        (MappedObject(0x6077, 0, 32), r"16 bit \(INTEGER16\)"),
    ],
)
def test_mapping_that_contradicts_the_types_is_refused(mapped: MappedObject, expected: str) -> None:
    with pytest.raises(ConfigMismatch, match=f"maps 0x{mapped.index:04X}.*expected {expected}"):
        codec(mapped)


@pytest.mark.parametrize("valid", [True, False])
def test_layout_is_read_from_its_objects(valid: bool) -> None:
    objects = {
        (0x1800, 1): 0x185 | (0 if valid else 1 << 31),
        (0x1800, 2): 1,
        (0x1A00, 0): 3,
        (0x1A00, 1): 0x60410010,
        (0x1A00, 2): 0x60770010,
        (0x1A00, 3): 0x606C0020,
    }
    layout = read_layout(lambda index, subindex: objects[index, subindex], 0x1800, 0x1A00)
    assert layout == PdoLayout(0x1800, 0x1A00, 0x185, valid, 1, TPDO.objects)
    assert ("switched off" in str(layout)) is not valid


def test_configuration_gives_the_layout_it_was_made_from() -> None:
    """Written to an empty dictionary in order, with the PDO off while the mapping changes."""
    objects: dict[tuple[int, int], int] = {}
    for index, subindex, value in configuration_writes(TPDO, present=0x185):
        if index == 0x1A00:
            assert objects[0x1800, 1] & 1 << 31
            assert subindex == 0 or objects[0x1A00, 0] == 0
        objects[index, subindex] = value
    assert read_layout(lambda index, subindex: objects[index, subindex], 0x1800, 0x1A00) == TPDO
