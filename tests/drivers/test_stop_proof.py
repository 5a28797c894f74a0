"""A dead host is noticed, or it is said that it is not; nothing of it commands torque."""

from collections import deque
from dataclasses import replace
from pathlib import Path

import pytest

from drivers.errors import ConfigMismatch, DeviceFault
from drivers.inverter.cia402 import Command, PowerState, next_state
from drivers.inverter.dead_time import MOST_CYCLES, dead_cycles
from drivers.inverter.settings import Acceptance
from hil.simulator.faults import InverterFaults
from tests.drivers.can_bench import M1, SIMULATED_M1, Bench, bench
from tests.drivers.eds_bench import without

PERIOD_S = 0.001
QUICK = replace(M1, rpdo_deadline_ms=50)


def torques(rig: Bench) -> list[float]:
    seen: list[float] = []
    rig.rig.add_step_callback(lambda time_s: seen.append(rig.rig.torque_nm[0]))
    return seen


def test_drive_that_watches_its_host_is_proved_to_stop_without_any_torque() -> None:
    with bench(settings=QUICK) as rig:
        seen = torques(rig)
        assert rig.m1.prove_stop(PERIOD_S) == ()
        assert len(seen) > 5
        assert set(seen) == {0.0}
        assert rig.m1._power.state() is PowerState.SWITCH_ON_DISABLED
        assert rig.m1.dead_cycles is not None  # 0 in an answer to the same SYNC; more where this machine is late


@pytest.mark.parametrize(("late", "counted"), [(0, 0), (3, 3), (MOST_CYCLES + 1, None)])
def test_the_dead_time_is_the_most_cycles_until_an_answer_shows_the_command(late: int, counted: int | None) -> None:
    shown = deque([PowerState.READY_TO_SWITCH_ON] * (late + 1), maxlen=late + 1)

    def exchange(command: Command) -> PowerState:
        shown.append(next_state(shown[-1], command))
        return shown[0]

    assert dead_cycles(exchange) == counted


@pytest.mark.parametrize("abort_connection", [1, 2, 3])
def test_every_way_to_abort_the_connection_is_proved_and_a_fault_it_makes_is_reset(abort_connection: int) -> None:
    settings = replace(QUICK, option_codes={0x6007: abort_connection})
    with bench(settings=settings) as rig:
        assert rig.m1.prove_stop(PERIOD_S) == ()
        assert rig.m1._power.state() is PowerState.SWITCH_ON_DISABLED
        assert rig.m1.fault() is None


def test_drive_that_does_nothing_without_its_host_is_found() -> None:
    """It tells both losses, and would keep its torque: the option code does not hold."""
    with bench(settings=QUICK) as rig:
        node = rig.rig._m1
        assert node is not None
        node._device.lose_connection = lambda error_code: None  # type: ignore[method-assign]
        differences = rig.m1.prove_stop(PERIOD_S)
    assert [each.what for each in differences] == ["stop without commands", "stop without heartbeat"]
    assert differences[0].found == (
        "EMCY 0x8250 RPDO timeout: the host's command did not come in time (error register 0x11), "
        "power state ready to switch on; the entry that failed is RPDO event timer 0x1400:05"
    )


def test_drive_that_does_not_notice_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("drivers.inverter.stop_proof.PATIENCE_S", 0.0)
    with bench(settings=QUICK) as rig:
        node = rig.rig._m1
        assert node is not None
        node.look_for_host = lambda now_ns: None  # type: ignore[method-assign]
        differences = rig.m1.prove_stop(PERIOD_S)
    said = "no EMCY, power state ready to switch on; the entry that failed is "
    assert [each.found for each in differences] == [
        f"{said}RPDO event timer 0x1400:05",
        f"{said}consumer heartbeat time 0x1016:01",
    ]
    assert differences[0].expected == "an EMCY 0x81xx or 0x82xx within 50 ms, and READY TO SWITCH ON left"


@pytest.mark.parametrize(
    ("gone", "name", "seen"),
    [
        ("1400sub5", "rpdo_deadline", "without commands and SYNC nothing happened within 50 ms"),
        ("1016", "heartbeat_consumer", ""),
    ],
)
def test_what_the_drive_lacks_is_refused_until_somebody_accepts_it_by_name(
    gone: str, name: str, seen: str, tmp_path: Path
) -> None:
    eds = tmp_path / "lacking.eds"
    eds.write_text(without(gone))
    simulated = replace(SIMULATED_M1, eds_path=eds)
    lacking = replace(QUICK, eds_path=eds)
    with pytest.raises(ConfigMismatch, match=rf'lacks .*{name} .*accepted\.{name} = {{ by = "NAME", why = "REASON" }}'):
        with bench(settings=lacking, simulated=simulated):
            raise AssertionError("nothing is built without it")
    accepted = {name: Acceptance("A. Nyone", "a relay of its own takes the power away")}
    with bench(settings=replace(lacking, accepted=accepted), simulated=simulated) as rig:
        assert rig.m1.prove_stop(PERIOD_S) == ()
        protections = {each.name: each for each in rig.m1.protections()}
    assert str(protections[name]).startswith(
        f"{name}: none, accepted by A. Nyone: a relay of its own takes the power away"
    )
    assert protections[name].proof == seen
    other = {"rpdo_deadline": "heartbeat_consumer", "heartbeat_consumer": "rpdo_deadline"}[name]
    assert protections[other].proof.startswith("proven after 0.")


def test_drive_that_somebody_drives_is_left_alone() -> None:
    with bench(settings=QUICK) as rig:
        rig.m1.configure()
        rig.m1.arm()
        with pytest.raises(DeviceFault, match="another program drives it"):
            rig.m1.prove_stop(PERIOD_S)
        assert rig.m1._power.state() is PowerState.OPERATION_ENABLED


@pytest.mark.parametrize("locked", [0x1016, 0x1400])
def test_drive_that_can_not_be_made_to_watch_is_refused(locked: int) -> None:
    with bench(InverterFaults(locked_objects=frozenset({locked})), settings=QUICK) as rig:
        with pytest.raises(ConfigMismatch, match=f"object 0x{locked:04X}.*0x06010002.*read only"):
            rig.m1.prove_stop(PERIOD_S)


def test_the_reaction_is_that_of_the_rig_file_where_it_has_one() -> None:
    with bench(settings=replace(QUICK, option_codes={0x6007: 3})) as rig:
        [reaction] = [each for each in rig.m1.protections() if each.name == "abort_connection"]
        assert "3 (quick stop)" in reaction.by
