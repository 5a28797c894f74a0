"""What registers hold, and which values no vehicle has: misread numbers are refused where they are read."""

import asyncio

import pytest

from drivers.errors import ProtocolViolation
from drivers.plc.named_registers import PLAUSIBLE, reading
from drivers.plc.plc import Plc
from drivers.plc.register import Register, WordOrder
from drivers.plc.register_map import USED, load_register_map
from drivers.resources import data_file
from hil.simulator.faults import PlcFaults
from hil.simulator.plc_device import PlcDevice
from hil.simulator.plc_server import serve_plc

MAP = load_register_map(data_file("plc.toml"))
HIGH, LOW = WordOrder.HIGH_WORD_FIRST, WordOrder.LOW_WORD_FIRST


def register(type_: str, unit: str, order: WordOrder | None, scale: float | None = None) -> Register:
    return Register.model_validate(
        {
            "kind": "input_register",
            "address": 0,
            "type": type_,
            "access": "read",
            "unit": unit,
            "description": "A register.",
            "word_order": None if order is None else order.value,
            "scale": scale,
        }
    )


@pytest.mark.parametrize(
    ("name", "type_", "unit", "scale", "value"),
    [
        ("torque_limit", "float32", "Nm", None, 350.0),
        ("torque_limit", "float32", "kNm", None, 0.35),
        ("torque_limit", "uint32", "Nm", 0.001, 350.0),
        ("torque_limit", "int32", "Nm", 0.1, 350.0),
        ("speed_limit", "float32", "1/min", None, 3200.0),
        ("speed_limit", "float32", "rad/s", None, 320.0),
        ("prbs_amplitude", "float32", "Nm", None, 120.5),
        ("prbs_torque", "float32", "Nm", None, 60.0),
        ("prbs_seed", "uint32", "1", None, 77),
        ("prbs_divider", "uint32", "1", None, 40),
        ("host_count_seen", "uint32", "1", None, 500),
    ],
)
@pytest.mark.parametrize("order", list(WordOrder))
def test_value_in_the_other_word_order_is_refused_with_what_it_would_be(
    name: str, type_: str, unit: str, scale: float | None, value: float, order: WordOrder
) -> None:
    there = register(type_, unit, order, scale)
    right = reading(name, there, there.encode(value))
    assert right.problem is None
    assert right.value == pytest.approx(value)
    assert right.unit == ("" if unit == "1" else unit)
    wrong = reading(name, there, there.encode(value)[::-1])
    other = HIGH if order is LOW else LOW
    assert wrong.problem is not None
    assert f"With word_order = '{other.value}' in the register map it would be {value:.7g} {unit}." in wrong.problem
    with pytest.raises(ProtocolViolation, match=rf"register {name} \(input_register 0\): expected 0, or "):
        wrong.required()


@pytest.mark.parametrize("name", sorted(PLAUSIBLE))
def test_zero_is_plausible_everywhere(name: str) -> None:
    unit = USED[name][1]
    there = register("uint32" if unit == "1" else "float32", unit, HIGH)
    assert reading(name, there, (0, 0)).problem is None


def test_limit_that_can_not_be_is_not_believed_in_a_run_either() -> None:
    """A speed limit of 1e-43 rad/s, or of 1e25, would hold nothing back, or everything."""

    async def run() -> None:
        async with serve_plc(PlcDevice(faults=PlcFaults(swaps_floats=True)), MAP) as served:
            async with Plc("127.0.0.1", served.port, MAP, timeout_s=10.0) as plc:
                readings = {each.name: each for each in await plc.read_registers()}
                assert readings["speed_limit"].problem is not None
                assert readings["torque_limit"].problem is None
                with pytest.raises(ProtocolViolation, match=r"PLC at .*register speed_limit.*expected 0, or 0\.1 to"):
                    await plc.read_status()

    asyncio.run(run())
