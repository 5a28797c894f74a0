"""What the system gives a run on the wall clock, asked for at its begin and given back at its end.

real-time scheduling   SCHED_FIFO, so that no ordinary program delays a cycle (Linux; needs CAP_SYS_NICE or a limit
                       ``rtprio``). Threads started meanwhile, such as the bus's receive thread, inherit it.
locked memory          mlockall, so that no page of the program is fetched from disk in the middle of a cycle (Linux;
                       needs CAP_IPC_LOCK or an unlimited ``memlock``)
timer slack            1 ns in place of the 50 us by which Linux may delay the wake-up of an ordinary thread
the interpreter        a thread that computes hands over after 0.1 ms in place of 5 ms, and what is in memory when the
                       run begins is left out of garbage collection, which else would stop a cycle for milliseconds

Of the first three nothing is needed for a run: what is not given is said, with the reason and the cure, in the run's
output and in its recording.
"""

from __future__ import annotations

import ctypes
import gc
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path

PRIORITY = 40
"""Of SCHED_FIFO, 1 to 99: above every ordinary program, below the kernel's own interrupt threads (50)."""

SWITCH_INTERVAL_S = 1e-4
"""After which a computing thread hands the interpreter over: a tenth of the shortest period."""

_LOCK_CURRENT, _LOCK_FUTURE, _LOCK_ON_FAULT = 1, 2, 4
"""Flags of mlockall(2). On fault: what has been touched stays, untouched stacks and buffers take no memory."""

_CAP_IPC_LOCK = 14

_SET_TIMER_SLACK, _GET_TIMER_SLACK = 29, 30
"""Options of prctl(2)."""


@dataclass(frozen=True, slots=True)
class Grant:
    """Whether one thing was given, and in words what or why not."""

    given: bool  # False also where it was not asked for
    statement: str  # a part of a sentence, without a full stop

    def __str__(self) -> str:
        return self.statement


@dataclass(frozen=True, slots=True)
class RealTimeGrants:
    """What the system gave a run."""

    scheduling: Grant  # SCHED_FIFO
    memory: Grant  # mlockall
    timer_slack: Grant  # of 1 ns

    def as_json(self) -> dict[str, dict[str, object]]:
        """Give them as a JSON document."""
        return asdict(self)

    @property
    def statement(self) -> str:
        """All of it in one line."""
        return f"{self.scheduling}; {self.memory}; {self.timer_slack}"


NOT_ASKED = RealTimeGrants(
    *(Grant(False, f"{what} not asked for: the run waits for no clock") for what in ("scheduling", "memory", "slack"))
)
"""Of a run that is as fast as its answers come."""


@contextmanager
def real_time() -> Iterator[RealTimeGrants]:
    """Ask the system for a run in real time, for the time of the block and of threads started in it."""
    with ExitStack() as back, _interpreter():
        yield RealTimeGrants(_scheduling(back), _memory(back), _timer_slack(back))


@contextmanager
def _interpreter() -> Iterator[None]:
    interval_s = sys.getswitchinterval()
    sys.setswitchinterval(SWITCH_INTERVAL_S)
    gc.collect()
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()
        sys.setswitchinterval(interval_s)


def _scheduling(back: ExitStack) -> Grant:
    if not hasattr(os, "sched_setscheduler"):
        return Grant(
            False, f"real-time scheduling not granted: {sys.platform} has no SCHED_FIFO that Python can ask for"
        )
    policy, parameters = os.sched_getscheduler(0), os.sched_getparam(0)
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
    except OSError as error:
        return Grant(
            False,
            f"real-time scheduling not granted: {error.strerror}. Give this program CAP_SYS_NICE, or its user a limit "
            f"rtprio of {PRIORITY} in /etc/security/limits.conf",
        )
    back.callback(os.sched_setscheduler, 0, policy, parameters)
    return Grant(True, f"real-time scheduling granted: SCHED_FIFO, priority {PRIORITY}")


def _memory(back: ExitStack) -> Grant:
    lock = _libc_function("mlockall")
    if lock is None:
        return Grant(False, f"memory lock not granted: {sys.platform} has no mlockall")
    if not _may_lock_all():  # within a limit it would succeed now, and an allocation fail in the middle of the run
        return Grant(
            False,
            "memory lock not granted: the limit memlock is finite. Give this program CAP_IPC_LOCK, or its user "
            "memlock unlimited in /etc/security/limits.conf",
        )
    if error := _call(lock, _LOCK_CURRENT | _LOCK_FUTURE | _LOCK_ON_FAULT):
        return Grant(False, f"memory lock not granted: {error}")
    unlock = _libc_function("munlockall")
    if unlock is not None:
        back.callback(_call, unlock)
    return Grant(True, "memory lock granted")


def _may_lock_all() -> bool:
    import resource  # of Unix alone

    return resource.getrlimit(resource.RLIMIT_MEMLOCK)[0] == resource.RLIM_INFINITY or _has_capability(_CAP_IPC_LOCK)


def _has_capability(number: int) -> bool:
    """Whether Linux gives this process a capability (capabilities(7)); False where it is not Linux."""
    status = Path("/proc/self/status")
    lines = status.read_text(encoding="ascii").splitlines() if status.exists() else []
    words = [line.split() for line in lines if line.startswith("CapEff:")]
    return bool(words) and bool(int(words[0][1], 16) >> number & 1)


def _timer_slack(back: ExitStack) -> Grant:
    control = _libc_function("prctl") if sys.platform == "linux" else None
    if control is None:
        return Grant(False, f"timer slack not granted: {sys.platform} has none to set")
    before_ns = control(_GET_TIMER_SLACK, 0, 0, 0, 0)
    if error := _call(control, _SET_TIMER_SLACK, 1, 0, 0, 0):
        return Grant(False, f"timer slack not granted: {error}")
    back.callback(_call, control, _SET_TIMER_SLACK, before_ns, 0, 0, 0)
    return Grant(True, "timer slack granted: 1 ns")


_Function = Callable[..., int]


def _libc_function(name: str) -> _Function | None:
    """Find a function of the C library; None where there is no such library or function."""
    try:
        library = ctypes.CDLL(None, use_errno=True)
        function: _Function = getattr(library, name)
    except (OSError, TypeError, AttributeError):  # Windows has no handle of the program itself
        return None
    return function


def _call(function: _Function, *arguments: int) -> str | None:
    """Call a function that gives 0 where it succeeds; the system's complaint where it does not."""
    words = tuple(ctypes.c_ulong(argument) for argument in arguments)
    return None if function(*words) == 0 else os.strerror(ctypes.get_errno())
