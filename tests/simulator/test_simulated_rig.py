"""The simulated rig: order within a step, determinism, callbacks, and how it ends."""

import threading

import pytest

from drivers.canopen.can_link import CanLink
from drivers.errors import DeviceTimeout
from hil.simulator.faults import InverterFaults
from hil.simulator.simulated_rig import SimulatedRig
from tests.drivers.can_bench import (
    HASTY_M1,
    SIMULATED_M1,
    SIMULATED_M2,
    Bench,
    bench,
    guarded,
    new_channel,
    virtual_bus,
)
from tests.simulator.rigid_plant import RigidPlant


class RecordingPlant:
    """Keeps what it was given; its speed counts the steps."""

    def __init__(self) -> None:
        self.steps: list[tuple[tuple[float, float], float]] = []

    @property
    def speed_rad_s(self) -> float:
        return 10.0 * len(self.steps)

    def advance(self, torque_nm: tuple[float, float], duration_s: float) -> None:
        self.steps.append((torque_nm, duration_s))


class BrokenPlant(RecordingPlant):
    def advance(self, torque_nm: tuple[float, float], duration_s: float) -> None:
        raise ZeroDivisionError("the plant is broken")


def armed(rig: Bench) -> Bench:
    for inverter in (rig.m1, rig.m2):
        inverter.configure()
        inverter.arm()
    return rig


def test_speed_is_sampled_before_the_torque_of_the_same_step_acts() -> None:
    """Torque k acts from time k to k + 1; the speed of row k is that of time k."""
    plant = RecordingPlant()
    with bench(plant=plant) as rig:
        armed(rig)
        stepped = threading.Event()
        rig.rig.add_step_callback(lambda time_s: stepped.set())
        for k in range(3):
            stepped.clear()
            feedback = rig.cycle(guarded(60.0 * k), guarded(6.0))
            assert feedback.speed_rad_s == pytest.approx(10.0 * k, abs=0.5)
            assert stepped.wait(60.0)
    assert plant.steps == [((pytest.approx(60.0 * k), pytest.approx(6.0)), 0.01) for k in range(3)]


def test_time_counts_steps_and_is_reported_to_callbacks() -> None:
    times_s: list[float] = []
    with bench() as rig:
        armed(rig)
        last = threading.Event()
        rig.rig.add_step_callback(times_s.append)
        rig.rig.add_step_callback(lambda time_s: last.set() if len(times_s) == 3 else None)
        for _ in range(3):
            rig.cycle()
        assert last.wait(60.0)
        assert rig.rig.time_s == pytest.approx(0.03)
    assert times_s == pytest.approx([0.01, 0.02, 0.03])


def tpdos(seed: int) -> list[bytes]:
    """Every TPDO of both inverters in a run of 200 cycles."""
    frames: list[bytes] = []
    with bench(seed=seed, plant=RigidPlant(100.0, 0.5, speed_rad_s=50.0)) as rig:
        armed(rig)
        for cob_id in (0x185, 0x186):
            rig.link.subscribe(cob_id, lambda data, t_ns: frames.append(data))
        for k in range(200):
            rig.m2.command(guarded(-0.6 * k))
            t_ns = rig.link.sync() if k % 7 == 0 else None
            rig.cycle(guarded(0.6 * k, 6.0 if k % 3 else -6.0))
            if t_ns is not None:
                assert rig.m2.await_feedback(t_ns, 5.0) is not None
        rig.link.sync()
        rig.m2.check()  # its answers come after the last TPDO, and that has then been seen by every subscriber
    return frames


def test_same_seed_and_commands_give_the_same_tpdos_byte_for_byte() -> None:
    first = tpdos(seed=3)
    assert len(first) == 2 * (200 + 29 + 1)
    assert tpdos(seed=3) == first
    assert tpdos(seed=4) != first


def test_absent_inverter_is_not_on_the_bus_and_gives_no_torque() -> None:
    with bench(InverterFaults(absent=True), settings=HASTY_M1) as rig:
        with pytest.raises(DeviceTimeout, match=r"inverter m1 \(node 5\): no SDO answer"):
            rig.m1.check()
        rig.m2.configure()
        rig.m2.arm()
        rig.m2.command(guarded(60.0))
        assert rig.m2.await_feedback(rig.link.sync(), 5.0) is not None
        assert rig.rig.torque_nm == pytest.approx((0.0, 60.0))


def test_inverter_that_hangs_from_the_start_is_silent() -> None:
    with bench(InverterFaults(hang_at_step=0), settings=HASTY_M1) as rig:
        with pytest.raises(DeviceTimeout, match="no SDO answer"):
            rig.m1.configure()


def test_defect_of_the_plant_stops_the_rig_and_is_raised_at_its_end() -> None:
    channel = new_channel()
    rig = SimulatedRig(virtual_bus(channel), BrokenPlant(), (SIMULATED_M1, SIMULATED_M2))
    with CanLink.open(f"virtual:{channel}") as link:
        link.sync()
        rig._link._thread.join(60.0)
    with pytest.raises(ZeroDivisionError, match="the plant is broken"):
        rig.close()
