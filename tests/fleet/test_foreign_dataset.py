"""A dataset that another survey places anew, or that somebody else has written: no row twice, none that is none."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet
import pytest

from hil.errors import StoreError
from hil.fleet.dataset import TABLES, Writer, read
from hil.fleet.page import fleet_page
from hil.fleet.run import Fleet
from hil.fleet.sources import FleetRecording
from hil.provenance import provenance
from tests.fleet.made_up import write_fleet


def test_a_corrected_pattern_rewrites_where_results_belong_without_computing(tmp_path: Path) -> None:
    write_fleet(tmp_path, vehicles=10, drives=5)
    before = {name: read(tmp_path, name) for name in TABLES}
    places = {
        row["sha256"]: FleetRecording(row["url"], f"tram_{row['vehicle'][4:]}", "b", "2025", row["sha256"])
        for row in before["recordings"]
    }
    age = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("part-*.parquet")}
    Writer(tmp_path, "identify").settle(Fleet(list(places.values())).place_of())  # of the other command's results too
    for name, rows in before.items():
        expected = [row | {"vehicle": f"tram_{row['vehicle'][4:]}", "rig": "b", "started": "2025"} for row in rows]
        assert read(tmp_path, name) == expected
    assert {path: path.stat().st_mtime_ns for path in tmp_path.rglob("part-*.parquet")} == age
    Writer(tmp_path, "diagnose").settle(Fleet([]).place_of())
    assert read(tmp_path, "recordings")[0]["rig"] == "b"
    assert len(Writer(tmp_path, "diagnose").known()) == 50


def test_a_key_comes_once_however_often_it_was_written(tmp_path: Path) -> None:
    write_fleet(tmp_path, vehicles=10, drives=5)
    before = {name: read(tmp_path, name) for name in TABLES}
    for name in TABLES:
        (part,) = (tmp_path / name).rglob("part-*.parquet")
        part.with_name("part-again.parquet").write_bytes(part.read_bytes())
    for _ in range(2):
        for name, rows in before.items():
            assert sorted(map(str, read(tmp_path, name))) == sorted(map(str, rows))
        Writer(tmp_path, "diagnose").settle(Fleet([]).place_of())
    tables = [pa.parquet.read_table(path) for path in (tmp_path / "recordings").rglob("part-*.parquet")]
    assert sum(table.num_rows for table in tables) == 50


ODD = [float("nan"), float("inf"), -float("inf"), None, 1e308, -1e308, 0.0, 5e-324]


@pytest.mark.parametrize("value", ODD)
def test_a_number_that_is_none_is_missing_and_the_page_is_written(tmp_path: Path, value: float | None) -> None:
    write_fleet(tmp_path, vehicles=20, drives=5)
    for name in TABLES:
        for path in (tmp_path / name).rglob("part-*.parquet"):
            table = pa.parquet.read_table(path)
            for column in table.schema.names:
                if table.schema.field(column).type == pa.float64():
                    cells = table[column].to_pylist()
                    cells[::2] = [value] * len(cells[::2])
                    place = table.schema.get_field_index(column)
                    table = table.set_column(place, column, pa.array(cells, pa.float64()))
            pa.parquet.write_table(table, path)
    with np.errstate(all="ignore"):
        page = fleet_page(tmp_path, provenance())
    assert "20 vehicles" in page


def without(column: str) -> Callable[[pa.Table], pa.Table]:
    return lambda table: table.set_column(
        table.schema.get_field_index(column), column, pa.nulls(table.num_rows, table.schema.field(column).type)
    )


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (without("key"), "a row without a key"),
        (without("n_recordings"), "a row of no recording"),
        (lambda table: table.set_column(0, "key", pa.array([[1]] * table.num_rows)), "cast"),
        (lambda table: table.set_column(0, "key", pa.array([b"\xff"] * table.num_rows)), "UTF8"),
    ],
)
def test_rows_that_can_be_of_no_recording_are_refused(
    tmp_path: Path, change: Callable[[pa.Table], pa.Table], said: str
) -> None:
    write_fleet(tmp_path, vehicles=2, drives=2)
    (path,) = (tmp_path / "recordings").rglob("part-*.parquet")
    pa.parquet.write_table(change(pa.parquet.read_table(path)), path)
    with pytest.raises(StoreError, match=f"got a damaged one: .*{said}"):
        fleet_page(tmp_path, provenance())


@pytest.mark.parametrize("column", [each for each in TABLES["recordings"].names if each not in ("key", "n_recordings")])
def test_any_other_column_may_be_empty_or_gone(tmp_path: Path, column: str) -> None:
    write_fleet(tmp_path, vehicles=2, drives=2)
    (path,) = (tmp_path / "recordings").rglob("part-*.parquet")
    table = pa.parquet.read_table(path)
    for changed in (without(column)(table), table.drop_columns([column])):
        pa.parquet.write_table(changed, path)
        assert "recordings" in fleet_page(tmp_path, provenance())
