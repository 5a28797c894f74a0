"""What is mutated, by which tests a mutant has to be found, and the mutants that no test can find.

A mutant that lives is listed with the reason why it does no harm; another one is a fault of the tests.
"""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Target:
    """One module, its tests, and its mutants that may live, by change, with the reason."""

    tests: tuple[str, ...]
    equivalent: dict[str, str] = field(default_factory=dict)


_SLACK = "differs where a torque is beyond its limit by the slack for rounding to the last bit"

TARGETS: dict[str, Target] = {
    "drivers.torque_guard": Target(
        ("tests/drivers/test_torque_guard.py", "tests/drivers/test_supervision.py"),
        {
            "abs(value_nm) <= limit_nm + ROUNDING_NM -> abs(value_nm) < limit_nm + ROUNDING_NM": _SLACK,
            "abs(base_nm - before_nm) <= allowed_nm + ROUNDING_NM -> abs(base_nm - before_nm) < allowed_nm + "
            "ROUNDING_NM": _SLACK,
        },
    ),
    "drivers.guard_limits": Target(("tests/drivers/test_torque_guard.py", "tests/drivers/test_supervision.py")),
    "drivers.inverter.supervision": Target(
        ("tests/drivers/test_supervision.py", "tests/drivers/test_prbs_of_plc.py", "tests/drivers/test_observer.py")
    ),
    "drivers.inverter.drive_supervision": Target(
        ("tests/drivers/test_supervision.py", "tests/drivers/test_prbs_of_plc.py")
    ),
    "drivers.inverter.observer": Target(("tests/drivers/test_observer.py", "tests/drivers/test_supervision.py")),
    "drivers.scaling": Target(("tests/drivers/test_scaling.py",)),
    "drivers.inverter.cia402": Target(
        ("tests/drivers/test_cia402.py",), {"0 -> 1 #3": "a previous controlword of which bit 7 alone counts"}
    ),
    "drivers.inverter.drive_settings": Target(
        (
            "tests/drivers/test_drive_settings.py",
            "tests/drivers/test_eds_other_drive.py",
            "tests/drivers/test_makers.py",
        )
    ),
    "drivers.canopen.heartbeat": Target(
        ("tests/drivers/test_heartbeat.py",),
        {
            "1000000.0 -> 1000001.0": "a millionth of a time in a message",
            "1000000.0 -> 1000001.0 #2": "a millionth of a time in a message",
            "True -> False": "whether a thread that hangs keeps the program from ending; it ends by its event",
        },
    ),
    "drivers.canopen.silence": Target(
        ("tests/drivers/test_silence.py",), {"0 -> 1": "a value before the first look, which sets it"}
    ),
    "drivers.canopen.foreign_controllers": Target(("tests/drivers/test_strangers.py",)),
    "hil.rig.catch_up": Target(
        ("tests/rig/test_catch_up.py",), {"0.0 -> 1.0": "what is held before the first cycle, which sets it"}
    ),
    "hil.config.guard_table": Target(("tests/config/test_rig_file.py", "tests/config/test_guard_table.py")),
    "drivers.foreign_file": Target(("tests/bad_input/test_one_rule.py",)),
    "hil.result_folder": Target(("tests/commission/test_state.py", "tests/report/test_pieces.py")),
    "hil.child": Target(("tests/bad_input/test_child.py",)),
    "hil.fleet.known": Target(("tests/fleet/test_known.py",)),
    "hil.fleet.sources": Target(("tests/fleet/test_known.py", "tests/fleet/test_sources.py")),
    "hil.fleet.dataset": Target(("tests/fleet/test_foreign_dataset.py", "tests/fleet/test_dataset.py")),
    "hil.recording.publish": Target(("tests/recording/test_round_trip.py",)),
    "hil.design.candidates": Target(("tests/design/test_candidates.py",)),
    "hil.design.solve_state": Target(("tests/design/test_solve.py",)),
    "hil.simulator.addresses": Target(("tests/simulator/test_simulated_rig.py",)),
    "hil.simulator.drive_physics": Target(("tests/simulator/test_drive_physics.py",)),
    "hil.simulator.faults": Target(("tests/simulator/test_faults.py",)),
    "hil.simulator.faulty_wire": Target(("tests/simulator/test_faulty_wire.py",)),
    "hil.simulator.plc_device": Target(("tests/simulator/test_plc_device.py",)),
    "hil.simulator.stopping": Target(("tests/simulator/test_stopping.py",)),
}
