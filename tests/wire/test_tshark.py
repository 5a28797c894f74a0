"""A bus trace read by Wireshark's own CANopen dissector: nothing malformed, and every message taken for what it is."""

import shutil
import subprocess
from collections import Counter
from pathlib import Path

import can
import pytest

from tests.wire.traced import traced_fault, traced_run

TSHARK = shutil.which("tshark")

pytestmark = pytest.mark.skipif(TSHARK is None, reason="tshark is not installed (apt-get install tshark)")

FIELDS = ("can.id", "canopen.function_code", "canopen.em.err_code", "_ws.malformed", "_ws.expert.severity")

SYNC_OR_EMCY = 0x1
"""One function code for both: SYNC is node 0's."""


def dissected(path: Path) -> list[dict[str, str]]:
    """What tshark says of every frame: CAN handed on to the CANopen dissector, as a user would choose it."""
    fields = [argument for field in FIELDS for argument in ("-e", field)]
    command = [str(TSHARK), "-n", "-r", str(path), "-d", "can.subdissector,canopen", "-T", "fields", *fields]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
    rows = [line.split("\t") for line in done.stdout.splitlines()]
    return [dict(zip(FIELDS, row, strict=True)) for row in rows]


def kind_of(cob_id: int) -> int:
    """Function code of an identifier in the predefined connection set (CiA 301, 7.3.5)."""
    return cob_id >> 7


@pytest.fixture(scope="module")
def trace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("wire") / "fault.blf"
    traced_fault(path)
    return path


def test_every_frame_is_canopen_and_none_is_malformed(trace: Path) -> None:
    frames = dissected(trace)
    assert len(frames) > 1000
    assert [frame for frame in frames if not frame["canopen.function_code"]] == []
    assert [frame for frame in frames if frame["_ws.malformed"] or frame["_ws.expert.severity"]] == []


def test_every_kind_of_message_is_reported_as_often_as_it_was_sent(trace: Path) -> None:
    with can.LogReader(trace) as reader:
        sent = Counter(kind_of(message.arbitration_id) for message in reader)
    reported = Counter(int(frame["canopen.function_code"], 16) for frame in dissected(trace))
    assert reported == sent
    names = {
        0x0: "NMT",
        SYNC_OR_EMCY: "SYNC",
        0x3: "TPDO 1",
        0x4: "RPDO 1",
        0xB: "SDO tx",
        0xC: "SDO rx",
        0xE: "heartbeat",
    }
    assert set(reported) == set(names), "a kind of message is missing on the bus, or one came that nobody sends"


def test_a_malformed_frame_would_be_reported(tmp_path: Path) -> None:
    """The test above can fail: an SDO request of one byte is no SDO request."""
    path = tmp_path / "short.blf"
    with can.Logger(path) as logger:
        logger(can.Message(timestamp=1.0, arbitration_id=0x601, data=b"\x40", is_extended_id=False))
    [frame] = dissected(path)
    assert frame["_ws.malformed"] or frame["_ws.expert.severity"]


def test_a_run_to_its_end_is_canopen_too(tmp_path: Path) -> None:
    path = tmp_path / "whole.blf"
    samples = traced_run(path)
    frames = dissected(path)
    syncs = [frame for frame in frames if int(frame["can.id"]) == 0x80]
    assert len(syncs) >= len(samples.rows)
    assert [frame for frame in frames if frame["_ws.malformed"] or not frame["canopen.function_code"]] == []
