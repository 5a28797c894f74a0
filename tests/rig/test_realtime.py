"""Real-time scheduling and memory lock: given and given back, or refused with reason and cure."""

import gc
import os
import sys

import pytest

from hil.rig import realtime
from hil.rig.realtime import NOT_ASKED, Grant, real_time
from tests.chosen import campaign

linux = pytest.mark.skipif(sys.platform != "linux", reason="SCHED_FIFO and mlockall are asked for as Linux has them")


def state() -> tuple[object, ...]:
    return os.sched_getscheduler(0), os.sched_getparam(0).sched_priority, sys.getswitchinterval(), gc.get_freeze_count()


@linux
def test_everything_is_given_back() -> None:
    before = state()
    with real_time() as grants:
        assert sys.getswitchinterval() == pytest.approx(realtime.SWITCH_INTERVAL_S)
        assert (os.sched_getscheduler(0) == os.SCHED_FIFO) is grants.scheduling.given
    assert state() == before


@linux
def test_refused_scheduling_is_said_with_its_cure(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*arguments: object) -> None:
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "sched_setscheduler", refuse)
    with real_time() as grants:
        pass
    assert not grants.scheduling.given
    assert "Operation not permitted" in grants.scheduling.statement
    assert "CAP_SYS_NICE" in grants.scheduling.statement


@linux
@pytest.mark.parametrize(("may", "words"), [(False, "CAP_IPC_LOCK"), campaign((True, "granted"))])
def test_memory_is_not_locked_within_a_limit(monkeypatch: pytest.MonkeyPatch, may: bool, words: str) -> None:
    """Within a limit the lock would hold now, and an allocation fail in the middle of the run."""
    monkeypatch.setattr(realtime, "_may_lock_all", lambda: may)
    with real_time() as grants:
        pass
    assert words in grants.memory.statement
    assert may or not grants.memory.given


@linux
def test_refused_lock_is_reported_in_the_systems_words(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(realtime, "_may_lock_all", lambda: True)
    monkeypatch.setattr(realtime, "_call", lambda function, *arguments: "Cannot allocate memory")
    with real_time() as grants:
        pass
    assert grants.memory == Grant(False, "memory lock not granted: Cannot allocate memory")
    assert not grants.timer_slack.given


def test_system_that_has_none_of_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(os, "sched_setscheduler", raising=False)
    monkeypatch.setattr(realtime, "_libc_function", lambda name: None)
    with real_time() as grants:
        pass
    for grant in (grants.scheduling, grants.memory, grants.timer_slack):
        assert not grant.given
        assert "not granted" in grant.statement


def test_run_without_a_clock_says_it_did_not_ask() -> None:
    assert NOT_ASKED.statement.count("not asked for") == 3
