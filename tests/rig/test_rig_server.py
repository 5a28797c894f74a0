"""Serving a simulated rig: addresses, what it needs of the rig file, and that nothing is left behind."""

import threading
from dataclasses import replace
from pathlib import Path

import pytest

from drivers.errors import BusDown
from estimator.errors import BadModel
from estimator.physics.model import Parameter
from hil.config.model_file import write_model
from hil.errors import UsageError
from hil.simulator.addresses import Address, with_addresses
from hil.simulator.driveline import DEFAULT_BUS, EffectSpec, plant_for, simulation_model
from hil.simulator.rig_server import RigServer
from tests.rig.serving import ANY_PORT, Samples, changed, run_once, small_rig
from tests.simulator.rigid_plant import RigidPlant

ANY_BUS = "ws://127.0.0.1:0/"
BIG_GAP = EffectSpec("backlash", {"gap_rad": 0.5})


def server(bus_url: str = ANY_BUS, modbus: Address = ANY_PORT) -> RigServer:
    return RigServer(RigidPlant(10.0, 0.5), small_rig(), bus_url, modbus)


def test_run_over_tcp_and_nothing_left_behind() -> None:
    before = threading.active_count()
    samples = Samples()
    with server() as served:
        rig = with_addresses(small_rig(), served.bus_url, str(served.modbus))
        run_once(rig, samples)
    assert len(samples.rows) == 100
    assert threading.active_count() == before


def test_taken_modbus_port_leaves_nothing_behind() -> None:
    with server() as first:
        before = threading.active_count()
        with pytest.raises(BusDown, match="listen"), server(modbus=first.modbus):
            pass
        assert threading.active_count() == before


def test_default_bus_stands_in_for_a_model_file() -> None:
    simulation = small_rig().simulation
    assert simulation is not None
    assert simulation_model(simulation) is DEFAULT_BUS


def test_effect_text_is_read() -> None:
    assert EffectSpec.parse("backlash:gap_rad=0.02,offset=-1e-3") == EffectSpec(
        "backlash", {"gap_rad": 0.02, "offset": -0.001}
    )
    assert EffectSpec.parse("backlash") == EffectSpec("backlash", {})


def test_effect_is_in_the_plant() -> None:
    """A gap of half a radian: the motor starts freely, with T / J_M, where the whole bus would hold it back."""
    free, held = (plant_for(small_rig(), effects) for effects in ([BIG_GAP], []))
    for plant in (free, held):
        for _ in range(5):
            plant.advance((50.0, 50.0), 0.01)
    assert free.speed_rad_s == pytest.approx(100.0 / 1.6 * 0.05, rel=0.02)
    assert held.speed_rad_s < 0.8 * free.speed_rad_s


def test_every_bound_of_the_catalogue_is_itself_let_in() -> None:
    """The bounds are those of the rig at hand: at them an effect is taken, a little beyond it is not."""
    at_limit = EffectSpec("transport_delay", {"delay_s": 20 * small_rig().period_s})
    assert plant_for(small_rig(), [at_limit]).speed_rad_s == 0.0
    with pytest.raises(UsageError, match=r"delay_s is 0\.201, expected 0 to 0\.2 s"):
        plant_for(small_rig(), [EffectSpec("transport_delay", {"delay_s": 0.201})])


def test_stribeck_friction_holds_the_motor_below_its_breakaway_torque() -> None:
    """40 Nm at both inverters do not break away 60 + 40 Nm; without the excess they do."""
    friction = {"coulomb_nm": 60.0, "stribeck_rad_s": 2.0}
    stuck, sliding = (
        plant_for(small_rig(), [EffectSpec("stribeck_friction", friction | {"excess_nm": excess_nm})])
        for excess_nm in (40.0, 0.0)
    )
    for plant in (stuck, sliding):
        for _ in range(500):
            plant.advance((40.0, 40.0), 0.01)
    assert sliding.speed_rad_s == pytest.approx(20.0 / 101.6 * 5.0, rel=0.1)  # (80 - 60) Nm on the whole bus
    assert abs(stuck.speed_rad_s) < 0.2 * sliding.speed_rad_s  # it creeps: friction changes sign over a little speed


def test_model_too_stiff_to_simulate_is_refused(tmp_path: Path) -> None:
    model = tmp_path / "stiff.toml"
    stiff = {**DEFAULT_BUS.parameters, "k": Parameter(4.2e12, 0.2)}
    write_model(model, replace(DEFAULT_BUS, parameters=stiff))
    with pytest.raises(BadModel, match=r"parameters\.k = 4\.2e\+12 .* expected at most"):
        plant_for(changed(small_rig(), {"simulation": {"model": model}}))
