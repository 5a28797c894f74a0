"""A fleet on real workers: the same on two and on a cluster elsewhere; killed in the middle; and what is refused."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.request import urlopen

import numpy as np
import pytest

from hil.cli.prove import _pool
from hil.errors import UsageError
from hil.fleet.dataset import TABLES, read
from hil.fleet.run import OF_DASK, OF_RESULTS, Engine, _require_alike, client_of
from hil.fleet.tasks import IDENTIFY, FleetJob, analyse
from hil.proof.work import work_on
from tests.benchmarks.buses import draw_bus, drive

BUSES, DRIVES, SECONDS = 2, 2, 4.0
LONGEST_S = 400.0

pytestmark = pytest.mark.timeout(480)  # workers import all of the estimator, on two cores that others use as well


@pytest.fixture(scope="module")
def drives(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("drives")
    for bus in range(BUSES):
        (folder / f"bus_{bus}").mkdir()
        for number in range(DRIVES):
            record = drive(draw_bus(bus), SECONDS, number)
            np.savetxt(
                folder / f"bus_{bus}" / f"run_{number}.csv",
                np.column_stack([record.time_s, record.torque_nm, record.output]),
                fmt="%.5f",
                delimiter=",",
                header="time_s,torque_m1_nm,torque_m2_nm,speed_rad_s",
                comments="",
            )
    (folder / "bus_0" / "copy.csv").write_bytes((folder / "bus_0" / "run_0.csv").read_bytes())
    (folder / "bus_1" / "cut.csv").write_bytes((folder / "bus_1" / "run_0.csv").read_bytes()[:2000])
    (folder / "bus_1" / "text.csv").write_text("time_s,torque_m1_nm\nno,number\n")
    return folder


def hil(*arguments: object) -> list[str]:
    return [sys.executable, "-m", "hil", "fleet", *map(str, arguments)]


def counts(*arguments: object) -> dict[str, Any]:
    """Run to the end and return what it counted."""
    done = subprocess.run(hil(*arguments, "--json"), capture_output=True, text=True, timeout=LONGEST_S, check=False)
    assert done.returncode == 0, done.stderr
    assert "dashboard" not in done.stderr
    content: dict[str, Any] = json.loads(done.stdout)
    return content


def content(dataset: Path) -> list[Any]:
    """Return all that is in a dataset but the time it took, in an order of its own."""
    tables = [
        sorted(
            (sorted((k, v) for k, v in row.items() if k != "seconds") for row in read(dataset, name)),
            key=str,
        )
        for name in TABLES
    ]
    return [*tables, {path.name: path.read_bytes() for path in (dataset / "verdicts").iterdir()}]


@pytest.fixture(scope="module")
def by_two(drives: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("by_two") / "results"
    assert counts("identify", drives, "--out", out, "--jobs", 2) == {
        "computed": BUSES * DRIVES,
        "known": 0,
        "failed": 2,
        "duplicates": 1,
        "sources": [],
    }
    return out


def test_the_pages_of_dask_are_there_while_it_runs_where_they_are_asked_for(drives: Path, tmp_path: Path) -> None:
    command = hil("identify", drives / "bus_0", "--out", tmp_path / "results", "--jobs", 1, "--dashboard")
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as fleet:
        assert fleet.stderr is not None
        said = next(line for line in fleet.stderr if "dashboard: " in line)
        address = said.partition("dashboard: ")[2].partition(",")[0]
        assert address.startswith("http://127.0.0.1:")
        with urlopen(address, timeout=LONGEST_S) as page:
            assert "Dask" in page.read().decode()
        fleet.stderr.read()
    assert fleet.returncode == 0


MODEL = """
schema = "hil.model/1"
structure = "two_mass"
[parameters]
J_M = { value = 1.7, tolerance = 0.4 }
J_L = { value = 100, tolerance = 0.4 }
k = { value = 4500, tolerance = 0.9 }
c = { value = 10, tolerance = 0.9 }
b_M = { value = 0.3, tolerance = 0.9 }
b_L = { value = 0.9, tolerance = 0.9 }
"""


def test_a_fleet_is_diagnosed_as_each_recording_alone_is_and_what_is_damaged_costs_itself(
    drives: Path, tmp_path: Path
) -> None:
    model, out, alone = tmp_path / "bus.toml", tmp_path / "results", tmp_path / "alone"
    model.write_text(MODEL)
    given = ["--model", model, "--effort", "quick", "--out"]
    counted = counts("diagnose", drives / "bus_0", drives / "bus_1" / "cut.csv", *given, out, "--jobs", 2)
    assert (counted["computed"], counted["failed"], counted["duplicates"]) == (DRIVES, 1, 1)
    assert [Path(row["url"]).name for row in read(out, "failures")] == ["cut.csv"]
    command = [sys.executable, "-m", "hil", "diagnose", drives / "bus_0" / "run_1.csv", *given, alone]
    one_core = os.environ | {"HIL_JOBS": "1", "OPENBLAS_NUM_THREADS": "1"}
    subprocess.run([*map(str, command)], env=one_core, stdout=subprocess.DEVNULL, timeout=LONGEST_S, check=True)
    (row,) = (each for each in read(out, "recordings") if each["name"] == "run_1.csv")
    found, expected = (
        {k: v for k, v in json.loads(path.read_text()).items() if k not in ("timing_s", "made")}
        for path in (out / "verdicts" / f"{row['key']}.json", alone / "diagnosis.json")
    )
    assert found == expected
    assert (row["verdict"], row["vehicle"], row["effort"]) == (expected["verdict"], "bus_0", "quick")
    values = {each["parameter"]: each["value"] for each in read(out, "parameters") if each["key"] == row["key"]}
    assert values == {name: each["value"] for name, each in expected["parameters"].items()}
    subprocess.run(hil("report", out), stdout=subprocess.DEVNULL, timeout=LONGEST_S, check=True)
    assert f"1 vehicles: {int(bool(expected['effects']))} with an effect" in (out / "fleet.html").read_text()


def test_what_is_damaged_is_listed_with_its_reason(by_two: Path) -> None:
    errors = {Path(row["url"]).name: row["error"] for row in read(by_two, "failures")}
    assert set(errors) == {"cut.csv", "text.csv"}
    assert "good samples, expected at least" in errors["cut.csv"]
    assert "text.csv" in errors["text.csv"]


@contextmanager
def cluster(folder: Path) -> Iterator[str]:
    """Start a scheduler and a worker as anybody would; the scheduler's address."""
    file = folder / "scheduler.json"
    common = ["--scheduler-file", str(file)]
    dask = [sys.executable, "-m", "dask"]
    commands = [
        [*dask, "scheduler", "--host", "127.0.0.1", "--port", "0", "--dashboard-address", "127.0.0.1:0", *common],
        [*dask, "worker", "--host", "127.0.0.1", "--dashboard-address", "127.0.0.1:0", "--nthreads", "1", *common],
    ]
    started = [subprocess.Popen(command, cwd=folder, stderr=subprocess.DEVNULL) for command in commands]
    try:
        wait_for(file.is_file)
        yield json.loads(file.read_text())["address"]
    finally:
        for process in started:
            process.terminate()
            process.wait(60)


def wait_for(condition: Any) -> None:
    end = time.monotonic() + LONGEST_S
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.05)


def test_a_cluster_elsewhere_with_one_worker_finds_the_same_to_the_last_bit(
    drives: Path, by_two: Path, tmp_path: Path
) -> None:
    with cluster(tmp_path) as address:
        wait_for(lambda: workers_of(address))
        counted = counts("identify", drives, "--out", tmp_path / "results", "--scheduler", address)
        with _pool(address) as pool:  # the proof's campaigns
            assert work_on(["a", "b"], str.upper, pool=pool, known={"a": "known"}) == {"a": "known", "b": "B"}
        with _pool(address) as pool, pytest.raises(TypeError, match="unsupported operand"):
            work_on(["a"], sum, pool=pool)
    assert counted["computed"] == BUSES * DRIVES
    assert content(tmp_path / "results") == content(by_two)


def workers_of(address: str) -> int:
    program = f"from distributed import Client\nwith Client('{address}') as c: print(len(c.nthreads()))"
    return int(subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout)


def children(process: int) -> list[int]:
    """Return the workers of a client."""
    found = subprocess.run(
        ["ps", "-ww", "-o", "pid=,args=", "--ppid", str(process)], capture_output=True, text=True, check=False
    )
    return [int(line.split()[0]) for line in found.stdout.splitlines() if "spawn_main" in line]


def test_a_worker_and_then_the_client_are_killed_and_the_next_run_completes_it(
    drives: Path, by_two: Path, tmp_path: Path
) -> None:
    out = tmp_path / "results"
    with subprocess.Popen(hil("identify", drives, "--out", out, "--jobs", 2), stderr=subprocess.DEVNULL) as client:
        wait_for(lambda: any((out / "verdicts").glob("*.json")))
        os.kill(children(client.pid)[-1], signal.SIGKILL)
        seen = len(list((out / "verdicts").iterdir()))
        wait_for(lambda: len(list((out / "verdicts").iterdir())) > seen or client.poll() is not None)
        assert client.poll() is None  # in the middle
        client.kill()
    wait_for(lambda: not children(client.pid))
    counted = counts("identify", drives, "--out", out, "--jobs", 2)
    assert counted["computed"] + counted["known"] == BUSES * DRIVES
    assert content(out) == content(by_two)
    again = counts("identify", drives, "--out", out, "--jobs", 1)
    assert (again["computed"], again["known"]) == (0, BUSES * DRIVES)


DEADLY = """
import os
from hil.fleet.run import Engine, client_of, hand_out

def work(item):
    if item == "wrong":
        raise ValueError("as given")
    return os._exit(1) if item == "deadly" else item.upper()

if __name__ == "__main__":
    with client_of(Engine(workers=1, retries=1)) as client:
        items = ["a", "deadly", "wrong", "b"]
        for item, result, error in hand_out(lambda: client, items, lambda item: client.submit(work, item)):
            print(item, result, error, sep="|")
"""


def test_work_that_takes_its_worker_with_it_costs_itself_alone(tmp_path: Path) -> None:
    (tmp_path / "deadly.py").write_text(DEADLY)
    restart_takes_long = {"DASK_DISTRIBUTED__DEPLOY__LOST_WORKER_TIMEOUT": "0.1s"}
    done = subprocess.run(
        [sys.executable, str(tmp_path / "deadly.py")],
        env={**os.environ, **restart_takes_long},
        capture_output=True,
        text=True,
        timeout=LONGEST_S,
        check=True,
    )
    assert sorted(done.stdout.splitlines()) == [
        "a|A|",
        "b|B|",
        "deadly|None|its worker died 2 times: out of memory, out of time, or killed",
        "wrong|None|ValueError: as given",
    ]


def test_a_scheduler_that_is_not_there_is_named(drives: Path, tmp_path: Path) -> None:
    command = hil("identify", drives, "--out", tmp_path / "results", "--scheduler", "tcp://127.0.0.1:1")
    done = subprocess.run(command, capture_output=True, text=True, timeout=LONGEST_S, check=False)
    assert done.returncode == 2
    assert "--scheduler tcp://127.0.0.1:1: expected a Dask scheduler that answers" in done.stderr
    assert not (tmp_path / "results").exists()


@pytest.mark.parametrize("memory", ["lots", "1MB"])
def test_workers_without_room_are_refused(memory: str) -> None:
    with pytest.raises(UsageError, match="--memory: expected auto, or 512MiB"), client_of(Engine(memory=memory)):
        pass


def test_nothing_but_empty_sources_is_refused(tmp_path: Path) -> None:
    done = subprocess.run(
        hil("identify", tmp_path, "--out", tmp_path / "out"),
        capture_output=True,
        text=True,
        timeout=LONGEST_S,
        check=False,
    )
    assert done.returncode == 2
    assert f"expected recordings, got none: {tmp_path}: expected recordings, got none" in done.stderr


class Cluster:
    """A client as far as versions go."""

    def __init__(self, scheduler: dict[str, str], workers: Sequence[dict[str, str]]) -> None:
        self._said = {
            "client": {"packages": versions()},
            "scheduler": {"packages": scheduler},
            "workers": {f"tcp://worker-{i}": {"packages": each} for i, each in enumerate(workers)},
        }

    def get_versions(self, packages: Sequence[str]) -> dict[str, Any]:
        return self._said


def versions(**others: str) -> dict[str, str]:
    return {**dict.fromkeys((*OF_DASK, *OF_RESULTS), "1"), **others}


@pytest.mark.parametrize(
    ("cluster", "message"),
    [
        (Cluster(versions(), [versions(), versions(numba="2")]), "numba 1 here, 2 at worker tcp://worker-1"),
        (Cluster(versions(dask="2"), [versions()]), "dask 1 here, 2 at the scheduler"),
        (Cluster(versions(), [{**versions(), "hil-driveline": "0"}]), "hil-driveline 1 here, 0 at worker"),
        (Cluster(versions(), []), "expected a cluster with workers, got none"),
    ],
)
def test_a_cluster_of_other_versions_is_refused_before_any_work(cluster: Any, message: str) -> None:
    with pytest.raises(UsageError, match=message):
        _require_alike(cluster)
    _require_alike(Cluster({**versions(), "numba": "9"}, [versions()]))  # type: ignore[arg-type]


def test_a_worker_that_joined_later_with_another_version_computes_nothing() -> None:
    outcome = analyse((), FleetJob(IDENTIFY, None, version="0.0"))
    assert outcome.error.startswith("expected a worker of hil 0.0, got one of hil ")
    assert not outcome.rows
