"""Caches of kernels: the old ones go with a new one, those in use and those used lately stay."""

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from estimator import kernel_cache
from estimator.kernel_cache import IN_USE, UNUSED_S, take

DAY_S = 86_400.0


@pytest.fixture(autouse=True)
def _locks_end_with_the_test(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    held: list[int] = []
    monkeypatch.setattr(kernel_cache, "_held", held)
    yield
    for file in held:
        os.close(file)


def cache(folder: Path, used_s_ago: float, in_use_file: bool = True) -> Path:
    """Make a cache with a kernel in it, last written and read so long ago."""
    kernel = folder / "integration_0" / "rates.nbi"
    kernel.parent.mkdir(parents=True)
    kernel.write_bytes(b"index")
    files = [kernel]
    if in_use_file:
        (folder / IN_USE).touch()
        files.append(folder / IN_USE)
    then = time.time() - used_s_ago
    for path in (*files, kernel.parent, folder):
        os.utime(path, (then, then))
    return folder


@pytest.mark.parametrize("in_use_file", [True, False], ids=["this version's", "an older version's"])
def test_with_a_new_cache_those_go_that_were_not_used_for_a_month(tmp_path: Path, in_use_file: bool) -> None:
    old = cache(tmp_path / "kernel-old", UNUSED_S + DAY_S, in_use_file)
    recent = cache(tmp_path / "kernel-recent", UNUSED_S - DAY_S, in_use_file)
    of_another_kind = cache(tmp_path / "truth-old", UNUSED_S + DAY_S)
    take(tmp_path / "kernel-new")
    assert not old.exists()
    assert recent.exists()
    assert of_another_kind.exists()
    assert (tmp_path / "kernel-new" / IN_USE).exists()


@pytest.mark.parametrize("moved", [0, 1], ids=["read", "written"])
def test_one_whose_kernel_was_read_or_written_lately_stays(tmp_path: Path, moved: int) -> None:
    old = cache(tmp_path / "kernel-old", UNUSED_S + DAY_S, in_use_file=False)
    times = [time.time() - UNUSED_S - DAY_S] * 2
    times[moved] = time.time() - DAY_S
    os.utime(old / "integration_0" / "rates.nbi", tuple(times))
    take(tmp_path / "kernel-new")
    assert old.exists()


def test_one_that_a_process_holds_stays_however_long_it_has_been_running(tmp_path: Path) -> None:
    held = tmp_path / "kernel-held"
    program = f"import pathlib, estimator.kernel_cache as k; k.take(pathlib.Path({str(held)!r})); print(1); input()"
    with subprocess.Popen([sys.executable, "-c", program], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == b"1\n"
        then = time.time() - UNUSED_S - DAY_S
        for path in (held / IN_USE, held):
            os.utime(path, (then, then))
        take(tmp_path / "kernel-new")
        assert held.exists()
        process.communicate(b"\n")
    for path in (held / IN_USE, held):
        os.utime(path, (then, then))
    take(tmp_path / "kernel-newer")
    assert not held.exists()


def test_taking_a_cache_that_is_there_removes_none_and_is_its_use(tmp_path: Path) -> None:
    mine = cache(tmp_path / "kernel-mine", UNUSED_S + DAY_S)
    other = cache(tmp_path / "kernel-other", UNUSED_S + DAY_S)
    take(mine)
    assert other.exists()
    os.close(kernel_cache._held.pop())
    take(tmp_path / "kernel-new")
    assert mine.exists()
    assert not other.exists()


def test_a_place_that_can_not_be_written_is_left_to_numba(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("no folder")
    take(tmp_path / "file" / "kernel-new")
    assert (tmp_path / "file").read_text() == "no folder"
