"""Counts to SI and back: exact at the limits, refused beyond them, never wrapped."""

import dataclasses
import math

import pytest
from hypothesis import given, strategies as st

from drivers.errors import CommandRefused, ConfigMismatch
from drivers.scaling import IntegerType, TorqueScale, VelocityScale

RATED = TorqueScale(600.0)
MILLI_RPM = 0xFDB44700


@pytest.mark.parametrize("kind", IntegerType)
def test_every_type_holds_its_limits_and_nothing_beyond(kind: IntegerType) -> None:
    for value in (kind.low, kind.low + 1, 0, kind.high - 1, kind.high):
        assert kind.decode(kind.encode(value, "here")) == value
    for value in (kind.low - 1, kind.high + 1):
        with pytest.raises(CommandRefused, match=rf"here: {value} does not fit {kind.name}"):
            kind.encode(value, "here")


def test_type_limits_are_those_of_the_standard() -> None:
    assert (IntegerType.INTEGER16.low, IntegerType.INTEGER16.high) == (-32768, 32767)
    assert (IntegerType.UNSIGNED32.low, IntegerType.UNSIGNED32.high) == (0, 4294967295)


@given(st.integers(-32768, 32767))
def test_every_torque_count_survives_the_way_to_nm_and_back(raw: int) -> None:
    assert RATED.to_raw(RATED.to_nm(raw), "here") == raw


def test_torque_is_per_mille_of_rated() -> None:
    assert RATED.to_nm(312) == pytest.approx(187.2)  # 0.312 * 600 Nm
    assert RATED.to_raw(-600.0, "here") == -1000


@pytest.mark.parametrize("torque_nm", [32767.6 * 0.6, -32768.6 * 0.6, math.nan, math.inf, -math.inf])
def test_torque_that_does_not_fit_is_refused(torque_nm: float) -> None:
    with pytest.raises(CommandRefused, match=r"here: torque .* expected -32768 to 32767"):
        RATED.to_raw(torque_nm, "here")


@pytest.mark.parametrize(
    ("unit", "rad_s_per_count"),
    [
        (MILLI_RPM, 2 * math.pi / 60 / 1000),
        (0x00B44700, 2 * math.pi / 60),  # rpm
        (0x00100300, 1.0),  # rad/s
        (0xFD100300, 1e-3),
        (0x00410300, math.pi / 180),  # degree/s
        (0x01B40300, 10 * 2 * math.pi),  # ten revolutions per second
    ],
)
def test_velocity_unit_is_decoded(unit: int, rad_s_per_count: float) -> None:
    assert VelocityScale.from_object(unit, "here").rad_s_per_count == pytest.approx(rad_s_per_count)


@pytest.mark.parametrize("unit", [0, 0xFD014700, 0xFDB44800, 0xFDB44701, 0x0AB44700, 0xF6B44700])
def test_unknown_velocity_unit_is_refused(unit: int) -> None:
    with pytest.raises(ConfigMismatch, match=f"here: SI unit velocity 0x60A9 is 0x{unit:08X}"):
        VelocityScale.from_object(unit, "here")


@given(st.integers(-(2**31), 2**31 - 1))
def test_every_speed_count_survives_the_way_to_rad_s_and_back(raw: int) -> None:
    scale = VelocityScale.from_object(MILLI_RPM, "here")
    assert scale.to_raw(scale.to_rad_s(raw), "here") == raw


@pytest.mark.parametrize("counts", [2**31, -(2**31) - 1, math.nan])
def test_speed_that_does_not_fit_is_refused(counts: float) -> None:
    scale = VelocityScale.from_object(MILLI_RPM, "here")
    with pytest.raises(CommandRefused, match=r"here: speed .* \(INTEGER32\)"):
        scale.to_raw(scale.rad_s_per_count * counts, "here")


def test_codes_and_ranges_are_those_of_cia_301() -> None:
    """Table "Object dictionary data types"; the code is what an EDS has as DataType."""
    assert {kind.name: (kind.value, kind.size_bytes, kind.low, kind.high) for kind in IntegerType} == {
        "INTEGER8": (0x02, 1, -128, 127),
        "INTEGER16": (0x03, 2, -32768, 32767),
        "INTEGER32": (0x04, 4, -2147483648, 2147483647),
        "UNSIGNED8": (0x05, 1, 0, 255),
        "UNSIGNED16": (0x06, 2, 0, 65535),
        "UNSIGNED32": (0x07, 4, 0, 4294967295),
    }


@pytest.mark.parametrize(("prefix", "power"), [(0x09, 9), (0xF7, -9)])
def test_the_largest_powers_of_ten_are_taken_and_the_next_are_not(prefix: int, power: int) -> None:
    radians_per_second = 0x00100300
    scale = VelocityScale.from_object(prefix << 24 | radians_per_second, "m1")
    assert scale.rad_s_per_count == pytest.approx(10.0**power)
    beyond = (prefix + (1 if power > 0 else -1)) << 24 | radians_per_second
    with pytest.raises(ConfigMismatch, match="a power of ten from -9 to 9"):
        VelocityScale.from_object(beyond, "m1")


@pytest.mark.parametrize(
    ("scale", "name"), [(TorqueScale(600.0), "rated_torque_nm"), (VelocityScale(0.1), "rad_s_per_count")]
)
def test_a_scale_can_t_be_changed(scale: object, name: str) -> None:
    with pytest.raises(dataclasses.FrozenInstanceError):
        setattr(scale, name, 1.0)
