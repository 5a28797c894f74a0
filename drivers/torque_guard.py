"""The torque guard: silent by default, one pure verdict, and the only maker of a torque command.

Rules, all of them on every request; one broken rule refuses the pair of both inverters:

1. every value is finite;
2. nothing but zero while the guard is not enabled (it starts that way);
3. per inverter, base + PRBS stays inside its torque limit;
4. per inverter, the PRBS part stays inside the PRBS limit;
5. per inverter, the base part moves no faster than the rate limit;
6. the sum of both inverters stays inside the sum limit: both act on one shaft (the paper's T_M1 + T_M2);
7. the feedback behind the request is not older than its time-out;
8. the PLC's permission is not older than its time-out;
9. the speed is inside the speed limit;
10. time runs forward.

What comes back is judged by `drivers.inverter.supervision`.

A refusal disables the guard and forgets what was commanded, so the way back starts at zero torque. Nothing is
ever clamped: a clamped PRBS is no PRBS, and a clamped torque is not the one the experiment recorded.

Why the PRBS has a limit of its own instead of the rate limit: a PRBS is a square wave, it crosses from one
level to the other inside one cycle, and its flat spectrum depends on doing so. A rate limit that lets it pass
would let the base torque jump just as far. An amplitude limit bounds the same thing, since a signal inside
+-prbs_limit can step by at most twice that. So in one cycle of ``dt`` seconds the torque of one inverter
changes by at most ``rate_limit * dt + 2 * prbs_limit``, whatever is requested.

Why the allowance of the rate limit does not grow: a loop that stalls must not come back with a step. ``dt`` counts
from the last command that was let through, up to one period and no further. So over any window of ``W`` seconds the
base torque changes by at most ``rate_limit * W``, which is opendbc's limit of the rate over a window.

No clock, bus or thread here: time comes in as nanoseconds of the caller's monotonic clock.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import InitVar, dataclass, fields
from typing import Final

from drivers.errors import CommandRefused
from drivers.guard_limits import NS_PER_S, ErrorLimits, GuardLimits

__all__ = ["ROUNDING_NM", "ErrorLimits", "Evidence", "GuardLimits", "GuardedTorque", "TorqueGuard", "TorqueRequest"]

ROUNDING_NM: Final = 1e-6
"""Slack for rounding in sums and products [Nm]: far above the 1e-13 of a double near 1000 Nm, and far below
the 0.1 % of rated torque an inverter resolves."""


class _Seal:
    """What only this module holds; see `GuardedTorque`."""

    __slots__ = ()


_SEAL: Final = _Seal()


@dataclass(frozen=True, slots=True)
class Evidence:
    """What a request is built on."""

    feedback_age_ns: int  # age of the oldest feedback behind it [ns]
    permissive_age_ns: int  # age of the PLC's permission [ns]
    speed_rad_s: float  # motor speed, of all readings the one furthest from standstill [rad/s]


@dataclass(frozen=True, slots=True)
class TorqueRequest:
    """What an experiment asks for, not yet allowed [Nm]; base and PRBS stay separate up to the inverter."""

    base_m1_nm: float  # of inverter m1, without PRBS [Nm]
    prbs_m1_nm: float  # PRBS of m1, and the damper's torque [Nm]
    base_m2_nm: float  # of inverter m2, without PRBS [Nm]
    prbs_m2_nm: float  # PRBS of m2, and the damper's torque [Nm]

    @property
    def total_m1_nm(self) -> float:
        """Base plus PRBS of inverter m1 [Nm]."""
        return self.base_m1_nm + self.prbs_m1_nm

    @property
    def total_m2_nm(self) -> float:
        """Base plus PRBS of inverter m2 [Nm]."""
        return self.base_m2_nm + self.prbs_m2_nm

    @property
    def is_zero(self) -> bool:
        """Whether every part is zero, so that nothing is asked for."""
        return not (self.base_m1_nm or self.prbs_m1_nm or self.base_m2_nm or self.prbs_m2_nm)


_REQUEST_NAMES: Final = tuple(field.name for field in fields(TorqueRequest))


@dataclass(frozen=True, slots=True)
class GuardedTorque:
    """Torque of one inverter that has passed the guard; the only thing an inverter accepts.

    Attributes
    ----------
    base_nm : float
        Base torque, for object 0x6071 [Nm].
    prbs_nm : float
        PRBS torque, for object 0x60B2 [Nm].

    Raises
    ------
    CommandRefused
        If built anywhere but in `TorqueGuard`: the third argument is a seal that only this module holds.
    """

    base_nm: float
    prbs_nm: float
    seal: InitVar[_Seal]  # that only this module has: nobody else can make one

    def __post_init__(self, seal: _Seal) -> None:
        if seal is not _SEAL:
            raise CommandRefused(
                f"torque guard: a command of {self.base_nm} Nm base and {self.prbs_nm} Nm PRBS was built "
                "outside the guard, expected it from TorqueGuard.check(). Ask the guard for it."
            )


_ZERO: Final = GuardedTorque(0.0, 0.0, _SEAL)


@dataclass(frozen=True, slots=True)
class _Past:
    """The last command that was let through: where the base torques stand, and since when."""

    t_ns: int  # when, host's monotonic clock [ns]
    base_m1_nm: float  # of m1 [Nm]
    base_m2_nm: float  # of m2 [Nm]


class TorqueGuard:
    """Let a pair of torque requests through unchanged, or refuse it and fall silent.

    Parameters
    ----------
    limits : GuardLimits
        The limits of the rig; they can't be changed later.
    """

    __slots__ = ("_enabled", "_limits", "_past")

    def __init__(self, limits: GuardLimits) -> None:
        self._limits = limits
        self._enabled = False
        self._past: _Past | None = None

    @property
    def limits(self) -> GuardLimits:
        """The limits this guard was built with."""
        return self._limits

    @property
    def enabled(self) -> bool:
        """Whether anything but zero torque can pass."""
        return self._enabled

    def enable(self) -> None:
        """Let torque pass from now on, starting at zero: the next request must have zero base torque.

        That first request also sets the time from which the rate limit counts.
        """
        self._enabled = True
        self._past = None

    def disable(self) -> None:
        """Fall silent: nothing but zero passes until `enable`."""
        self._enabled = False
        self._past = None

    def zero(self) -> tuple[GuardedTorque, GuardedTorque]:
        """Give the pair of zero commands, always allowed.

        The drives then stand at zero, so the next request must have zero base torque, as after `enable`.
        """
        self._past = None
        return _ZERO, _ZERO

    def check(self, request: TorqueRequest, now_ns: int, evidence: Evidence) -> tuple[GuardedTorque, GuardedTorque]:
        """Turn a request into the commands of inverters m1 and m2, unchanged, or refuse both.

        Parameters
        ----------
        request : TorqueRequest
            Base and PRBS torque of both inverters [Nm].
        now_ns : int
            Time of this request [ns]; it never runs backwards. The rate limit counts in it, so the time at which
            the cycle was due serves best: a cycle that began late is then no faster change.
        evidence : Evidence
            What the request was built on.

        Returns
        -------
        tuple of GuardedTorque
            Commands for m1 and m2.

        Raises
        ------
        CommandRefused
            Naming every broken rule with limit and value. The guard is then disabled and its history is zero.
        """
        faults = tuple(self._faults(request, now_ns, evidence))
        if faults:
            self.disable()
            raise CommandRefused(
                f"torque guard: {'; '.join(faults)}. The guard is now disabled: send zero torque, fix the "
                "cause, enable it again."
            )
        if not self._enabled:
            return _ZERO, _ZERO
        self._past = _Past(now_ns, request.base_m1_nm, request.base_m2_nm)
        return (
            GuardedTorque(request.base_m1_nm, request.prbs_m1_nm, _SEAL),
            GuardedTorque(request.base_m2_nm, request.prbs_m2_nm, _SEAL),
        )

    def _faults(self, request: TorqueRequest, now_ns: int, evidence: Evidence) -> Iterator[str]:
        """Name every broken rule; see the module's list."""
        if not_finite := tuple(_not_finite(request)):
            yield from not_finite  # no comparison below means anything with NaN in it
            return
        if not self._enabled:
            if not request.is_zero:
                yield f"torque requested ({_shown(request)}) while not enabled, expected zero until enable()"
            return
        yield from _magnitude_faults(request, self._limits)
        yield from self._rate_faults(request, now_ns)
        yield from _evidence_faults(evidence, self._limits)

    def _rate_faults(self, request: TorqueRequest, now_ns: int) -> Iterator[str]:
        past = self._past or _Past(now_ns, 0.0, 0.0)
        elapsed_s = (now_ns - past.t_ns) / NS_PER_S
        if elapsed_s < 0.0:
            yield (
                f"time of the request is {now_ns} ns, expected at least the {past.t_ns} ns of the one "
                "before: pass one monotonic clock"
            )
        rate = self._limits.rate_limit_nm_per_s
        allowed_nm = rate * max(0.0, min(elapsed_s, self._limits.period_s))
        parts = (("m1", request.base_m1_nm, past.base_m1_nm), ("m2", request.base_m2_nm, past.base_m2_nm))
        for inverter, base_nm, before_nm in parts:
            if not abs(base_nm - before_nm) <= allowed_nm + ROUNDING_NM:
                yield (
                    f"inverter {inverter}: base torque goes from {before_nm:g} Nm to {base_nm:g} Nm in "
                    f"{elapsed_s:g} s, expected a change of at most {allowed_nm:g} Nm (rate_limit_nm_per_s = "
                    f"{rate:g}): start from zero and ramp more slowly"
                )


def _not_finite(request: TorqueRequest) -> Iterator[str]:
    for name in _REQUEST_NAMES:
        value = getattr(request, name)
        if not math.isfinite(value):
            yield f"{name} is {value}, expected a finite number: look for NaN in its feedback"


def _magnitude_faults(request: TorqueRequest, limits: GuardLimits) -> Iterator[str]:
    """Rules 3, 4 and 6: one table, one comparison. Written so that what can't be compared is refused."""
    lower_both = "lower the base torque or the PRBS amplitude"
    table = (
        ("inverter m1: base + PRBS torque", request.total_m1_nm, "torque_limit_m1_nm", lower_both),
        ("inverter m2: base + PRBS torque", request.total_m2_nm, "torque_limit_m2_nm", lower_both),
        ("inverter m1: PRBS torque", request.prbs_m1_nm, "prbs_limit_nm", "lower the PRBS amplitude"),
        ("inverter m2: PRBS torque", request.prbs_m2_nm, "prbs_limit_nm", "lower the PRBS amplitude"),
        ("sum of both inverters", request.total_m1_nm + request.total_m2_nm, "sum_limit_nm", lower_both),
    )
    for what, value_nm, name, cure in table:
        limit_nm = getattr(limits, name)
        if not abs(value_nm) <= limit_nm + ROUNDING_NM:
            yield f"{what} is {value_nm:g} Nm, expected at most {limit_nm:g} Nm either way ({name}): {cure}"


def _evidence_faults(evidence: Evidence, limits: GuardLimits) -> Iterator[str]:
    """Rules 7, 8 and 9."""
    ages = (
        ("feedback", evidence.feedback_age_ns, "feedback_timeout_s", "an inverter that stopped answering SYNC"),
        ("permission of the PLC", evidence.permissive_age_ns, "permissive_timeout_s", "a PLC that answers no more"),
    )
    for what, age_ns, name, look_for in ages:
        age_s, limit_s = age_ns / NS_PER_S, getattr(limits, name)
        if not 0.0 <= age_s <= limit_s:
            yield f"{what} is {age_s:g} s old, expected between 0 s and {limit_s:g} s ({name}): look for {look_for}"
    if not abs(evidence.speed_rad_s) <= limits.speed_limit_rad_s:
        yield (
            f"speed is {evidence.speed_rad_s:g} rad/s, expected at most {limits.speed_limit_rad_s:g} rad/s either way "
            "(speed_limit_rad_s): lower the speed of the experiment"
        )


def _shown(request: TorqueRequest) -> str:
    return ", ".join(f"{field.name} = {getattr(request, field.name):g}" for field in fields(request))
