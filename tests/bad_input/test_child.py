"""Processes that this program starts end with all they have started, and nobody waits at a pipe that others hold."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from hil.child import PACKAGES, Pipe, end, environment, has_ended, python, run, start
from tests.processes import GONE_S, is_gone

LEAVES = "import os, sys, time\nif not os.fork(): {child}\n"


@pytest.mark.skipif(not Path("/proc").is_dir(), reason="no /proc")
@pytest.mark.parametrize("limit_s", [0.5, 60.0])
def test_what_a_command_has_started_ends_with_it(tmp_path: Path, limit_s: float) -> None:
    code = LEAVES.format(child="open('child', 'w').write(str(os.getpid())); time.sleep(1000)")
    code += "while not os.path.exists('child') or not open('child').read(): time.sleep(0.01)\n"
    code += "time.sleep(1000)" if limit_s < 1.0 else "sys.exit('done')"
    done = run(python("-c", code), tmp_path, limit_s if limit_s > 1.0 else GONE_S / 4.0)
    assert (done.status, done.said) == ((None, "") if limit_s < 1.0 else (1, "done\n"))
    assert is_gone(int((tmp_path / "child").read_text()))


def test_a_process_inherits_no_open_file_of_this_one(tmp_path: Path) -> None:
    with (tmp_path / "open").open("w") as file:
        os.set_inheritable(file.fileno(), True)
        code = f"import os\ntry: os.fstat({file.fileno()})\nexcept OSError: raise SystemExit(3)"
        assert run(python("-c", code), tmp_path, 60.0).status == 3


def test_a_module_in_the_working_folder_is_not_imported(tmp_path: Path) -> None:
    (tmp_path / "pickle.py").write_text("raise SystemExit(3)")
    assert run(python("-c", "import pickle, hil"), tmp_path, 60.0, environment()).status == 0
    assert str(PACKAGES) in environment()["PYTHONPATH"].split(os.pathsep)


def fill(pipe: Pipe) -> None:
    while True:
        pipe.write(bytes(1 << 16))


@pytest.mark.skipif(os.name != "posix", reason="a pipe that can be waited at")
def test_a_pipe_ends_with_its_process_or_its_time_and_what_was_written_before_is_read() -> None:
    code = LEAVES.format(child="os.setsid(); print(os.getpid(), flush=True); time.sleep(30); os._exit(0)")
    process = start([sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE, bufsize=0)
    assert process.stdin is not None
    assert process.stdout is not None
    reader, writer = Pipe(process.stdout, process), Pipe(process.stdin, process)
    said = b""
    began_s = time.monotonic()
    while piece := reader.read(1):
        said += piece
    assert int(said) > 1  # which holds the other end, in a session of its own
    with pytest.raises(BrokenPipeError):
        fill(writer)
    assert time.monotonic() - began_s < GONE_S
    assert has_ended(process)
    assert end(process) == 0
    os.kill(int(said), 9)

    process = start([sys.executable, "-c", "input()"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, bufsize=0)
    assert process.stdout is not None
    reader = Pipe(process.stdout, process)
    reader.limit_at_s = time.monotonic() + 0.2
    assert reader.read(1) == b""
    assert not has_ended(process)
    assert end(process) == -9
