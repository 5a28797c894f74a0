"""What is in the dataset is whole, also after a kill between two files, and with a disk that is full."""

from pathlib import Path

import pytest

from hil.errors import StoreError, UsageError
from hil.fleet.dataset import FAILURES, TABLES, Writer, read, require_dataset
from tests.fleet.made_up import write_fleet
from tests.full_disk import largest_file


def test_every_table_can_be_read_with_the_command_that_made_it(tmp_path: Path) -> None:
    write_fleet(tmp_path, vehicles=10, drives=5)
    recordings = read(tmp_path, "recordings")
    assert len(recordings) == 50
    assert {row["command"] for row in recordings} == {"diagnose"}
    assert set(TABLES["recordings"].names) <= set(recordings[0])
    assert len(read(tmp_path, "effects")) == len(read(tmp_path, "parameters")) == 2 * 2
    assert [row["error"] for row in read(tmp_path, "failures")] == ["no samples"]
    assert len(list((tmp_path / "verdicts").iterdir())) == 50


def test_results_are_known_by_their_keys_and_what_was_not_committed_is_removed(tmp_path: Path) -> None:
    write_fleet(tmp_path, vehicles=2, drives=5)
    (part,) = (tmp_path / "recordings").rglob("part-*.parquet")
    part.rename(tmp_path / "recordings.parquet")  # as if the run had been killed before it wrote this one
    assert Writer(tmp_path, "diagnose").known() == set()
    assert not list((tmp_path / "effects").rglob("part-*.parquet"))
    write_fleet(tmp_path, vehicles=2, drives=5)
    assert len(Writer(tmp_path, "diagnose").known()) == 10
    assert Writer(tmp_path, "identify").known() >= set()
    assert len(read(tmp_path, "effects")) == 2


def test_a_full_disk_is_named_and_what_is_there_stays(tmp_path: Path) -> None:
    write_fleet(tmp_path, vehicles=2, drives=2)
    with largest_file(0), pytest.raises(UsageError, match=r"expected room for results, got: .* call again"):
        write_fleet(tmp_path, vehicles=3, drives=3)
    assert len(read(tmp_path, "recordings")) == 4


def test_a_damaged_part_is_named(tmp_path: Path) -> None:
    write_fleet(tmp_path, vehicles=1, drives=1)
    (part,) = (tmp_path / "recordings").rglob("part-*.parquet")
    part.write_bytes(b"PAR1" + bytes(20))
    with pytest.raises(StoreError, match=r"part-.*: expected a part of a dataset of hil fleet, got a damaged one"):
        read(tmp_path, "recordings")


def test_a_folder_that_is_no_dataset_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="expected a dataset that hil fleet"):
        require_dataset(tmp_path)
    assert read(tmp_path, "failures") == []
    assert not (tmp_path / FAILURES).exists()
