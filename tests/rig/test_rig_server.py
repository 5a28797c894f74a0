"""Serving a simulated rig: addresses, what it needs of the rig file, and that nothing is left behind."""

import threading
from dataclasses import replace
from pathlib import Path

import pytest

from drivers.canopen.can_link import CanLink
from drivers.errors import BusDown
from estimator.errors import BadModel
from estimator.physics.model import EffectValue, Parameter
from hil.config.model_file import write_model
from hil.errors import UsageError
from hil.simulator.addresses import Address, with_addresses
from hil.simulator.driveline import DEFAULT_BUS, EffectSpec, plant_for, simulation_model
from hil.simulator.plant import RigidPlant
from hil.simulator.rig_server import RigServer
from tests.rig.serving import ANY_PORT, Samples, changed, run_once, small_rig

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


def test_free_ports_are_reported() -> None:
    with server() as served:
        assert served.modbus.port > 0
        assert served.bus_url.startswith("ws://127.0.0.1:")
        assert served.bus_url != ANY_BUS


def test_taken_modbus_port_leaves_nothing_behind() -> None:
    with server() as first:
        before = threading.active_count()
        with pytest.raises(BusDown, match="listen"), server(modbus=first.modbus):
            pass
        assert threading.active_count() == before


def test_host_sees_a_rig_that_goes_away() -> None:
    with server() as served:
        link = CanLink.open(served.bus_url)
    with link, pytest.raises(BusDown):
        _sync_until_it_fails(link)


def _sync_until_it_fails(link: CanLink) -> None:
    while True:
        link.sync()


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


def test_an_optional_parameter_may_be_at_its_null() -> None:
    """No contact depth is below the bounds of a fit, and a law of its own: the damping acts at first touch."""
    plant_for(small_rig(), [EffectSpec("backlash", {"gap_rad": 0.02, "contact_rad": 0.0})])


def test_a_gap_that_is_given_alone_has_a_depth_of_contact() -> None:
    """A twentieth of it; damping that acts all at once would be a law of its own."""
    alone, deep, sudden = (
        plant_for(small_rig(), [EffectSpec("backlash", {"gap_rad": 0.02, **more})])
        for more in ({}, {"contact_rad": 0.001}, {"contact_rad": 0.0})
    )
    for step in range(60):
        torque_nm = 40.0 if step % 20 < 10 else -40.0
        for plant in (alone, deep, sudden):
            plant.advance((torque_nm, torque_nm), 0.01)
    assert alone.speed_rad_s == deep.speed_rad_s != sudden.speed_rad_s


def test_bounds_without_any_experiment_to_go_by() -> None:
    rig = small_rig().model_copy(update={"experiments": {}})
    with pytest.raises(UsageError, match="gap_rad is 3, expected 0 to"):
        plant_for(rig, [EffectSpec("backlash", {"gap_rad": 3.0})])


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


def test_model_file_with_a_profile_is_refused(tmp_path: Path) -> None:
    model = tmp_path / "hills.toml"
    profile = {"road_grade": {"grade_rms_nm": EffectValue(20.0)}}
    write_model(model, replace(DEFAULT_BUS, effects=profile))
    rig = changed(small_rig(), {"simulation": {"model": model}})
    with pytest.raises(UsageError, match=r"'road_grade'.*Take it out of --effect, or \[effects\.road_grade\] out of"):
        plant_for(rig)


def test_model_too_stiff_to_simulate_is_refused(tmp_path: Path) -> None:
    model = tmp_path / "stiff.toml"
    stiff = {**DEFAULT_BUS.parameters, "k": Parameter(4.2e12, 0.2)}
    write_model(model, replace(DEFAULT_BUS, parameters=stiff))
    with pytest.raises(BadModel, match=r"parameters\.k = 4\.2e\+12 .* expected at most"):
        plant_for(changed(small_rig(), {"simulation": {"model": model}}))


def test_plant_is_stepped_by_its_own_period_only() -> None:
    with pytest.raises(ValueError, match=r"0\.02 s, expected the 0\.01 s"):
        plant_for(small_rig()).advance((0.0, 0.0), 0.02)
