"""What others leave in a folder of recordings, in a dataset, or try at a port: it costs itself, and nothing else."""

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet
import pytest

from hil.errors import HilError, StoreError
from hil.fleet.dataset import TABLES, Writer, read
from hil.fleet.known import Survey, stamp
from hil.fleet.page import fleet_page
from hil.fleet.run import Fleet
from hil.fleet.sources import Found, Seen, at_hand, find, in_order, seen
from hil.provenance import provenance
from hil.result_folder import sole_use
from tests.fleet import made_up
from tests.fleet.made_up import write_fleet

ROWS = "time_s,torque_m1_nm,torque_m2_nm,speed_rad_s\n0,1,1,1\n0.01,1,1,1\n"
LONGEST_S = 400.0

pytestmark = pytest.mark.timeout(480)


def hil(*arguments: object, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run ``hil fleet`` as it is installed: ``python -P`` is what its script amounts to."""
    command = [sys.executable, "-P", "-m", "hil", "fleet", *map(str, arguments)]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=LONGEST_S, check=False)


KNOCKS = """
import os, sys
from distributed import Client, Security
from distributed.comm.core import CommClosedError
import asyncio
from distributed.comm import connect
os.setgroups([]); os.setgid(65534); os.setuid(65534)

async def knock(address, security):
    arguments = security.get_connection_args("client") if security else {}
    try:
        comm = await connect(address, timeout=3, **arguments)
        await comm.write({"op": "identity", "reply": True})
        return await asyncio.wait_for(comm.read(), 3)
    except (OSError, ValueError, RuntimeError, TypeError, asyncio.TimeoutError) as error:
        return None

for port in sys.argv[1:]:
    for address, security in (
        (f"tcp://127.0.0.1:{port}", None),
        (f"tls://127.0.0.1:{port}", Security.temporary()),
    ):
        if asyncio.run(knock(address, security)):
            print("answered", address)
print("knocked")
"""

SERVES = """
import glob, os, subprocess, sys
from hil.fleet.run import Engine, client_of

def listening(process):
    inodes = set()
    for entry in os.listdir(f"/proc/{process}/fd"):
        try:
            inodes.add(os.readlink(f"/proc/{process}/fd/{entry}").removeprefix("socket:[").removesuffix("]"))
        except OSError:
            pass
    for table in ("tcp", "tcp6", "udp", "udp6"):
        for line in open(f"/proc/net/{table}").readlines()[1:]:
            words = line.split()
            if words[9] in inodes and (words[3] == "0A" or table.startswith("udp")):
                yield table, words[1]

if __name__ == "__main__":
    with client_of(Engine(workers=1)) as client:
        children = [c for task in glob.glob("/proc/self/task/*/children") for c in open(task).read().split()]
        found = [each for process in ("self", *children) for each in listening(process)]
        assert len(found) == 3, found  # scheduler, nanny, worker
        assert all(table == "tcp" and address.startswith("0100007F:") for table, address in found), found
        ports = [str(int(address.split(":")[1], 16)) for _, address in found]
        safe, path, folder = client.submit(lambda: (sys.flags.safe_path, sys.path, os.getcwd())).result()
        assert safe
        assert "" not in path and folder not in path, path
        local = next(iter(client.run(lambda dask_worker: dask_worker.local_directory).values()))
        assert os.stat(os.path.dirname(os.path.dirname(local))).st_mode & 0o777 == 0o700, local
        done = subprocess.run([sys.executable, sys.argv[1], *ports], capture_output=True, text=True, timeout=300)
        print(done.stdout, done.stderr)
"""


@pytest.mark.skipif(not hasattr(os, "getuid") or os.getuid() != 0, reason="only root can be another user")
def test_another_user_gets_no_answer_at_any_port_that_a_cluster_opens(tmp_path: Path) -> None:
    for name, text in (("serves.py", SERVES), ("knocks.py", KNOCKS)):
        (tmp_path / name).write_text(text)
    (tmp_path / "elsewhere").mkdir()
    done = subprocess.run(
        [sys.executable, "-P", tmp_path / "serves.py", tmp_path / "knocks.py"], cwd=tmp_path / "elsewhere",
        capture_output=True, text=True, timeout=LONGEST_S, check=False, env={**os.environ, "PYTHONPATH": os.getcwd()},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == ["knocked"], done.stdout


def test_a_folder_of_strange_things_costs_each_itself(tmp_path: Path) -> None:
    drives = tmp_path / "drives [2026]::a"
    drives.mkdir()
    for name in ("a[1].csv", "b*.csv", "c?.csv", "d::e.csv"):
        (drives / name).write_text(ROWS.replace("0.01", f"0.0{len(name)}{ord(name[0])}"))
    os.mkfifo(drives / "pipe.csv")
    (drives / "zero.csv").symlink_to("/dev/zero")
    (drives / "circle").symlink_to(drives)
    ran = tmp_path / "ran"
    for name in ("pickle.py", "numpy.py", "distributed.py"):
        (tmp_path / name).write_text(f"open({str(ran)!r}, 'a').write('ran')")
    done = hil("identify", drives, "--out", "results", "--jobs", 1, "--retries", 0, "--json", folder=tmp_path)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["sources"] == []
    errors = {Path(row["url"]).name: row["error"] for row in read(tmp_path / "results", "failures")}
    assert "a pipe, not a regular file" in errors.pop("pipe.csv")
    assert "a device, not a regular file" in errors.pop("zero.csv")
    assert set(errors) == {"a[1].csv", "b*.csv", "c?.csv", "d::e.csv"}
    assert all("expected 10 usable samples or more" in error for error in errors.values()), errors
    assert not ran.exists()


@pytest.mark.parametrize("name", ["a[1].csv", "b*.csv", "c?.csv", "d::e.csv"])
def test_a_name_is_a_name_whatever_is_in_it(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text(ROWS)
    (tmp_path / "a1.csv").write_text(ROWS)
    for source in (tmp_path / name, tmp_path):
        found, complaints = find([str(source)], None)
        assert str(tmp_path / name) in [each.url for each in found]
        assert complaints == []
    assert seen(str(tmp_path / name)).sha256
    assert len(find([f"{tmp_path}/?1.csv"], None)[0]) == 1


@pytest.mark.parametrize("chain", ["zip://*.csv::file://", "zip://a.csv::file://", "zip::file://"])
def test_what_is_in_an_archive_is_listed_so_that_it_can_be_fetched(tmp_path: Path, chain: str) -> None:
    import zipfile

    with zipfile.ZipFile(tmp_path / "x.zip", "w") as archive:
        archive.writestr("a.csv", ROWS)
    (found,), complaints = find([f"{chain}{tmp_path}/x.zip"], None)
    assert complaints == []
    with at_hand(found.url) as path:
        assert path.read_text() == ROWS
    first = stamp(found.url)
    assert first == stamp(found.url)


def test_what_has_not_changed_is_known_and_what_has_is_read(tmp_path: Path) -> None:
    path, side = tmp_path / "a.csv", tmp_path / "a.csv.json"
    path.write_text(ROWS)
    stamps = [stamp(str(path))]
    os.utime(path, ns=(0, 1))
    stamps.append(stamp(str(path)))
    path.write_text(ROWS.replace("0.01", "0.02"))
    os.utime(path, ns=(0, 1))  # size and time alone would not tell
    stamps.append(stamp(str(path)))
    side.write_text("{}")
    stamps.append(stamp(str(path)))
    assert "" not in stamps
    assert len(set(stamps)) == 4
    os.mkfifo(tmp_path / "pipe.csv")
    assert stamp(str(tmp_path / "pipe.csv")) == ""
    survey = Survey([])
    survey.note("a", stamps[0], Seen("1", "bus", "rig", "2026"))
    again = Survey(survey.rows())
    assert again.seen("a", stamps[0]) == Seen("1", "bus", "rig", "2026")
    assert again.seen("a", stamps[1]) is again.seen("b", stamps[0]) is again.seen("a", "") is None


def test_vehicles_come_as_people_count() -> None:
    names = ["bus_10", "bus_2", "bus_02b", "bus_1", "", "9" * 5000]
    assert sorted(names, key=in_order) == ["", "9" * 5000, "bus_1", "bus_2", "bus_02b", "bus_10"]
    fleet = Fleet([Found("x", "bus_10", sha256="1"), Found("y", "bus_9", sha256="2")])
    assert [piece[0].vehicle for piece in fleet.pieces(by_vehicle=True)] == ["bus_9", "bus_10"]


def test_a_corrected_pattern_rewrites_where_results_belong_without_computing(tmp_path: Path) -> None:
    write_fleet(tmp_path, vehicles=10, drives=5)
    before = {name: read(tmp_path, name) for name in TABLES}
    places = {
        row["sha256"]: Found(row["url"], f"tram_{row['vehicle'][4:]}", "b", "2025", row["sha256"])
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


def test_a_second_call_on_the_same_folder_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(ROWS)
    with sole_use(tmp_path / "results"):
        done = hil("identify", "a.csv", "--out", "results", folder=tmp_path)
    assert done.returncode == 2
    assert f"expected no other call at work in this folder, got process {os.getpid()}" in done.stderr


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


def test_a_recording_that_takes_too_long_to_read_ends_its_worker_and_costs_itself() -> None:
    code = (
        "import hil.fleet.tasks as tasks, time\ntasks.seen = lambda url: time.sleep(60)\n"
        "tasks.describe(tasks.Found('x'), 0.2)"
    )
    done = subprocess.run([sys.executable, "-c", code], check=False, timeout=LONGEST_S)
    assert done.returncode == 1
    with pytest.raises(HilError, match="expected a readable file"):
        seen("/nowhere/x.csv")


def test_made_up_rows_have_every_table() -> None:
    assert set(made_up._rows(0, 3, 8.0, True, 0.01)) == set(TABLES)
