"""What others leave in a folder of recordings, in a dataset, or try at a port: it costs itself, and nothing else."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from hil.errors import HilError
from hil.fleet.dataset import read
from hil.fleet.sources import seen
from hil.result_folder import sole_use

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


def test_a_second_call_on_the_same_folder_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(ROWS)
    with sole_use(tmp_path / "results"):
        done = hil("identify", "a.csv", "--out", "results", folder=tmp_path)
    assert done.returncode == 2
    assert f"expected no other call at work in this folder, got process {os.getpid()}" in done.stderr


def test_a_recording_that_takes_too_long_to_read_ends_its_worker_and_costs_itself() -> None:
    code = (
        "import hil.fleet.tasks as tasks, time\ntasks.seen = lambda url: time.sleep(60)\n"
        "tasks.describe(tasks.Found('x'), 0.2)"
    )
    done = subprocess.run([sys.executable, "-c", code], check=False, timeout=LONGEST_S)
    assert done.returncode == 1
    with pytest.raises(HilError, match="expected a readable file"):
        seen("/nowhere/x.csv")
