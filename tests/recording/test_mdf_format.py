"""MDF: what other tools find in a file of ours, and what is read of theirs."""

from __future__ import annotations

import struct
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from asammdf import MDF, Signal

from hil.recording import Table, read_table, write_table

RIG = 'name = "bench"\n\n[guard]\n  indented = 1\n'


@pytest.fixture
def ours(tmp_path: Path, own_table: Table) -> Path:
    said = {"experiment": "cruise", "started_utc": "2026-11-21T10:00:00+00:00", "rig_file": RIG, "pace": "fast"}
    write_table(replace(own_table, metadata=said), tmp_path / "run.mf4")
    return tmp_path / "run.mf4"


def test_other_tools_find_one_timed_group_with_units_and_comments(ours: Path, own_table: Table) -> None:
    with MDF(ours) as mdf:
        assert mdf.version == "4.10"
        assert len(mdf.groups) == 1
        assert mdf.get_master(0).tolist() == own_table.columns["time_s"].tolist()
        master = mdf.groups[0].channels[0]
        assert (master.name, master.unit, master.channel_type, master.sync_type) == ("time_s", "s", 2, 1)
        torque = mdf.get("torque_m1_nm")
        assert (torque.unit, torque.comment) == ("Nm", "torque actual value of inverter m1 (0x6077)")
        assert torque.samples.tolist() == own_table.columns["torque_m1_nm"].tolist()
        assert mdf.header.start_time.isoformat() == "2026-11-21T10:00:00+00:00"
        assert mdf.header._common_properties["experiment"] == "cruise"
        assert mdf.header.subject == "cruise"
        attached = {str(a.file_name): bytes(mdf.extract_attachment(k)[0]) for k, a in enumerate(mdf.attachments)}
    assert attached["rig.toml"].decode() == RIG


def foreign(path: Path) -> None:
    """Two groups of one rate, one of another, an array, and samples their own file calls invalid."""
    fast, slow = np.arange(20) * 0.01, np.arange(4) * 0.1
    invalid = np.arange(20) % 5 == 1
    with MDF(version="4.11") as mdf:
        mdf.append([Signal(np.arange(4.0), slow, name="temperature", unit="°C")])
        mdf.append(
            [
                Signal(np.arange(20.0), fast, name="Motor Torque", unit="Nm"),
                Signal(np.arange(20, dtype=np.uint8), fast, name="gear"),
                Signal(np.arange(20.0) / 3, fast, name="speed", unit="rad/s", invalidation_bits=invalid),
            ]
        )
        mdf.append([Signal(np.arange(20) > 3, fast, name="clutch")])
        mdf.append([Signal(np.arange(20.0), fast, name="gear")])
        mdf.header.description = "second lap"
        mdf.save(path)


@pytest.fixture
def theirs(tmp_path: Path) -> Path:
    foreign(tmp_path / "theirs.mf4")
    return tmp_path / "theirs.mf4"


def test_of_other_programs_the_groups_of_one_time_are_the_recording(theirs: Path) -> None:
    table = read_table(theirs)
    assert list(table.columns) == ["time", "Motor Torque", "gear", "speed", "clutch", "gear (2)"]
    assert table.columns["gear"].dtype == np.int64
    assert np.flatnonzero(np.isnan(table.columns["speed"])).tolist() == [1, 6, 11, 16]
    assert table.units["Motor Torque"] == "Nm"
    assert table.metadata["comment"] == "second lap"
    assert [remark.split(":")[0] for remark in table.remarks] == ["gear", "temperature"]


def test_a_file_its_writer_never_finished_is_finalised_in_a_copy(tmp_path: Path) -> None:
    """What a logger leaves that lost its power: flags in the identification, no cycle count, no data length."""
    path = tmp_path / "torn.mf4"
    times = np.arange(50) * 0.01
    with MDF(version="4.10") as mdf:
        mdf.append([Signal(np.arange(50.0), times, name="speed", unit="rad/s")])
        mdf.save(path)
    with MDF(path) as mdf:
        group, record_bytes = mdf.groups[0], 16
        count_place = group.channel_group.address + 24 + 8 * group.channel_group.links_nr + 8
        data_place = group.data_group.data_block_addr
    content = bytearray(path.read_bytes())
    assert struct.unpack_from("<Q", content, count_place) == (50,)
    assert content[data_place : data_place + 4] == b"##DT"
    struct.pack_into("<Q", content, count_place, 0)
    struct.pack_into("<Q", content, data_place + 8, 24)
    content[:8] = b"UnFinMF "
    struct.pack_into("<H", content, 60, 0x01 | 0x04)
    # The data block is the last of the file, as a logger has it, and its last record is torn.
    end = data_place + 24 + 50 * record_bytes
    data = bytes(content[data_place:end])
    torn = bytes(content[:data_place]) + bytes(len(data)) + bytes(content[end:]) + data[:-3]
    torn = torn.replace(struct.pack("<Q", data_place), struct.pack("<Q", len(torn) - len(data) + 3), 1)
    path.write_bytes(torn)
    table = read_table(path)
    assert table.columns["speed"][:49].tolist() == np.arange(49.0).tolist()
    assert any("never finished" in remark for remark in table.remarks)
    assert path.read_bytes() == torn
