"""Failures that files show before anything moves: rig file, data sheet, limits, recordings that are damaged."""

from functools import partial
from pathlib import Path

import can

from tests.cli import bench
from tests.docs.gallery.case import Failure, Outcome, said
from tests.docs.gallery.recordings import cruise
from tests.docs.gallery.rig_failures import EXAMPLE, write_rig

EDS = EXAMPLE.parents[1] / "eds" / "inverter.eds"


def outcome_of(command: str) -> Outcome:
    """Carry out a command, show all of it."""
    text, status = said(command)
    return Outcome(command, text, status)


def rig_file() -> Outcome:
    """Check a rig file with three faults."""
    write_rig(
        (
            ("period_s = 0.01 ", 'period_s = "10ms" '),
            ("[inverters.m2]\nnode_id = 2", "[inverters.m2]\nnode_id = 200"),
            ("sum_limit_nm = 700.0", "sum_limit = 700.0"),
        )
    )
    return outcome_of("hil check rig.toml")


def data_sheet(before: str, after: str) -> Outcome:
    """Check an EDS that lacks what the tool needs."""
    text = EDS.read_text(encoding="utf-8")
    if text.count(before) != 1:
        raise LookupError(f"{EDS} holds {before!r} {text.count(before)} times, expected once")
    Path("drive.eds").write_text(text.replace(before, after), encoding="utf-8")
    return outcome_of("hil check --eds drive.eds")


def unsigned_torque() -> Outcome:
    """Check an EDS that has the torque actual value without a sign."""
    before = "[6077]\nParameterName=Torque actual value\nObjectType=0x7\nDataType=0x0003"
    return data_sheet(before, before.replace("0x0003", "0x0006"))


def two_channels() -> Outcome:
    """Replay a log of two buses."""
    write_rig()
    with can.Logger("drive.log") as logger:
        for n in range(3):
            for channel in ("can0", "can1"):
                logger(can.Message(timestamp=1.0 + n, arbitration_id=0x80, is_extended_id=False, channel=channel))
    return outcome_of("hil replay drive.log --rig rig.toml --out again.csv")


def limits_refused() -> Outcome:
    """Plan a run whose PRBS is above what its limits allow."""
    write_rig((("amplitude_nm = 120.0", "amplitude_nm = 300.0"),))
    return outcome_of("hil run rig.toml cruise --dry-run")


def time_backwards() -> Outcome:
    """Diagnose a recording whose time runs backwards in one row."""
    bench.record(Path("run_1.csv"), 1, noise=0.02)
    bench.model(Path("model.toml"))
    rows = Path("run_1.csv").read_text(encoding="utf-8").splitlines(keepends=True)
    rows[700], rows[701] = rows[701], rows[700]
    Path("run_1.csv").write_text("".join(rows), encoding="utf-8")
    return outcome_of("hil diagnose run_1.csv --model model.toml --out result")


def cut_short() -> Outcome:
    """Identify a recording of which a copy was not finished."""
    path = cruise(Path("run_1.parquet"), 120.0, duration_s=3.0)
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    return outcome_of("hil identify run_1.parquet --out identified")


_ENTRY = "[1A00sub2]\nParameterName=Mapped object 2\nObjectType=0x7\nDataType=0x0007\n"
MAPPED = f"{_ENTRY}AccessType=rw\nDefaultValue=0x60770010"
OTHER_FOR_GOOD = f"{_ENTRY}AccessType=ro\nDefaultValue=0x60780010"
"""The TPDO's second object, and another one that can't be changed."""

FILES = (
    Failure("rig_file", rig_file, quick=True),
    Failure("missing_eds_object", partial(data_sheet, "\n[6071]\n", "\n[60B3]\n"), quick=True),
    Failure("wrong_pdo_map", partial(data_sheet, MAPPED, OTHER_FOR_GOOD), quick=True),
    Failure("unsigned_torque", unsigned_torque, quick=True),
    Failure("two_channels", two_channels, quick=True),
    Failure("limits_refused", limits_refused, quick=True),
    Failure("time_backwards", time_backwards, quick=True),
    Failure("cut_recording", cut_short, quick=True),
)
