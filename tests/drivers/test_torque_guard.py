"""The torque guard: every rule alone refuses, every limit itself passes, nothing is clamped."""

import copy
import dataclasses
import math
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import given, settings, strategies as st

from drivers import torque_guard
from drivers.errors import CommandRefused, ConfigMismatch
from drivers.torque_guard import (
    ROUNDING_NM,
    ErrorLimits,
    Evidence,
    GuardedTorque,
    GuardLimits,
    TorqueGuard,
    TorqueRequest,
)

LIMITS = GuardLimits(
    torque_limit_m1_nm=400.0,
    torque_limit_m2_nm=300.0,
    prbs_limit_nm=120.0,
    rate_limit_nm_per_s=2000.0,
    sum_limit_nm=500.0,
    feedback_timeout_s=0.08,
    permissive_timeout_s=1.0,
    speed_limit_rad_s=200.0,
    period_s=0.05,
    error=ErrorLimits(m1_nm=20.0, m2_nm=15.0, sum_nm=25.0, time_s=0.05, response_s=0.02),
)
MS = 1_000_000
PERIOD_NS = 50 * MS
TIMEOUT_NS = 80 * MS
PERMISSIVE_NS = 1000 * MS
STEP_NM = 100.0  # rate limit * period: the largest step there is, however long ago the last one was

BEYOND_NM = 10 * ROUNDING_NM
"""The smallest excess worth the name: above the guard's slack for rounding."""


def seen(feedback_age_ns: int, permissive_age_ns: int = 0, speed_rad_s: float = 0.0) -> Evidence:
    """What a request is built on, fresh but for what is given."""
    return Evidence(feedback_age_ns, permissive_age_ns, speed_rad_s)


FRESH = seen(0)


def guard_at(base_m1_nm: float = 0.0, base_m2_nm: float = 0.0) -> tuple[TorqueGuard, int]:
    """Enable a guard and ramp it to base torques; returns it and the time of the last request."""
    guard = TorqueGuard(LIMITS)
    guard.enable()
    steps = math.ceil(max(abs(base_m1_nm), abs(base_m2_nm)) / STEP_NM) or 1
    for k in range(steps + 1):
        part = k / steps
        guard.check(TorqueRequest(part * base_m1_nm, 0.0, part * base_m2_nm, 0.0), k * PERIOD_NS, seen(0))
    return guard, steps * PERIOD_NS


@dataclasses.dataclass(frozen=True)
class Case:
    """A request that breaks one rule by a hair, and its twin at the limit; both follow on one state."""

    rule: str
    start: tuple[float, float]
    inside: TorqueRequest
    outside: TorqueRequest
    dt_ns: int = 1000 * MS
    seen_inside: Evidence = FRESH
    seen_outside: Evidence = FRESH


def near(rule: str, start: tuple[float, float], *at_limit: float, part: int) -> Iterator[Case]:
    """Cases for both signs, where ``part`` is the one of the four torques that is pushed over the limit."""
    for sign in (1.0, -1.0):
        inside = [sign * value for value in at_limit]
        outside = list(inside)
        outside[part] += sign * BEYOND_NM
        yield Case(rule, (sign * start[0], sign * start[1]), TorqueRequest(*inside), TorqueRequest(*outside))


HOLD = TorqueRequest(100.0, 0.0, 0.0, 0.0)

CASES = [
    *near("torque_limit_m1_nm", (350.0, 0.0), 350.0, 50.0, 0.0, 0.0, part=0),
    *near("torque_limit_m1_nm", (350.0, 0.0), 350.0, 50.0, 0.0, 0.0, part=1),
    *near("torque_limit_m2_nm", (0.0, 250.0), 0.0, 0.0, 250.0, 50.0, part=2),
    *near("torque_limit_m2_nm", (0.0, 250.0), 0.0, 0.0, 250.0, 50.0, part=3),
    *near("prbs_limit_nm", (0.0, 0.0), 0.0, 120.0, 0.0, 0.0, part=1),
    *near("prbs_limit_nm", (0.0, 0.0), 0.0, 0.0, 0.0, 120.0, part=3),
    *near("rate_limit_nm_per_s", (0.0, 0.0), STEP_NM, 0.0, 0.0, 0.0, part=0),
    *near("rate_limit_nm_per_s", (0.0, 0.0), 0.0, 0.0, STEP_NM, 0.0, part=2),
    *near("rate_limit_nm_per_s", (-50.0, 0.0), 50.0, 0.0, 0.0, 0.0, part=0),
    *near("rate_limit_nm_per_s", (0.0, -50.0), 0.0, 0.0, 50.0, 0.0, part=2),
    *near("sum_limit_nm", (300.0, 100.0), 300.0, 50.0, 100.0, 50.0, part=1),
    *near("sum_limit_nm", (300.0, 100.0), 300.0, 50.0, 100.0, 50.0, part=3),
    Case("feedback_timeout_s", (100.0, 0.0), HOLD, HOLD, 10 * MS, seen(TIMEOUT_NS), seen(TIMEOUT_NS + 1)),
    Case("feedback_timeout_s", (100.0, 0.0), HOLD, HOLD, 10 * MS, seen(0), seen(-1)),
    Case("permissive_timeout_s", (100.0, 0.0), HOLD, HOLD, 10 * MS, seen(0, PERMISSIVE_NS), seen(0, PERMISSIVE_NS + 1)),
    Case("permissive_timeout_s", (100.0, 0.0), HOLD, HOLD, 10 * MS, seen(0, 0), seen(0, -1)),
    Case("speed_limit_rad_s", (100.0, 0.0), HOLD, HOLD, 10 * MS, seen(0, 0, 200.0), seen(0, 0, 200.001)),
    Case("speed_limit_rad_s", (100.0, 0.0), HOLD, HOLD, 10 * MS, seen(0, 0, -200.0), seen(0, 0, -200.001)),
    Case("speed_limit_rad_s", (100.0, 0.0), HOLD, HOLD, 10 * MS, seen(0), seen(0, 0, math.nan)),
]


@pytest.mark.parametrize("case", CASES)
def test_at_the_limit_passes_unchanged(case: Case) -> None:
    guard, last_ns = guard_at(*case.start)
    m1, m2 = guard.check(case.inside, last_ns + case.dt_ns, case.seen_inside)
    assert (m1.base_nm, m1.prbs_nm) == (case.inside.base_m1_nm, case.inside.prbs_m1_nm)
    assert (m2.base_nm, m2.prbs_nm) == (case.inside.base_m2_nm, case.inside.prbs_m2_nm)
    assert guard.enabled


@pytest.mark.parametrize("case", CASES)
def test_each_rule_broken_alone_refuses_and_names_itself(case: Case) -> None:
    guard, last_ns = guard_at(*case.start)
    with pytest.raises(CommandRefused, match=case.rule) as refusal:
        guard.check(case.outside, last_ns + case.dt_ns, case.seen_outside)
    assert "; " not in str(refusal.value), "another rule refused as well: the case does not test this one"
    assert not guard.enabled


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("part", ["base_m1_nm", "prbs_m1_nm", "base_m2_nm", "prbs_m2_nm"])
@pytest.mark.parametrize("enabled", [True, False])
def test_what_is_not_finite_is_refused(part: str, value: float, enabled: bool) -> None:
    guard = TorqueGuard(LIMITS)
    if enabled:
        guard.enable()
    with pytest.raises(CommandRefused, match=f"{part} is {value}, expected a finite number"):
        guard.check(dataclasses.replace(TorqueRequest(0.0, 0.0, 0.0, 0.0), **{part: value}), 0, seen(0))


@pytest.mark.parametrize("part", ["base_m1_nm", "prbs_m1_nm", "base_m2_nm", "prbs_m2_nm"])
@pytest.mark.parametrize("value", [1e-300, -1e-300, 1.0, -400.0])
def test_silent_until_enabled(part: str, value: float) -> None:
    guard = TorqueGuard(LIMITS)
    with pytest.raises(CommandRefused, match="while not enabled, expected zero"):
        guard.check(dataclasses.replace(TorqueRequest(0.0, 0.0, 0.0, 0.0), **{part: value}), 0, seen(0))


def test_zero_passes_while_not_enabled_however_old_the_feedback() -> None:
    commands = TorqueGuard(LIMITS).check(TorqueRequest(0.0, 0.0, 0.0, 0.0), 0, seen(10 * TIMEOUT_NS))
    assert [(each.base_nm, each.prbs_nm) for each in commands] == [(0.0, 0.0)] * 2


def test_time_that_runs_backwards_is_refused() -> None:
    guard, last_ns = guard_at(100.0)
    with pytest.raises(CommandRefused, match="pass one monotonic clock"):
        guard.check(HOLD, last_ns - 1, seen(0))


def test_every_broken_rule_is_named_at_once() -> None:
    guard, last_ns = guard_at()
    with pytest.raises(CommandRefused) as refusal:
        guard.check(TorqueRequest(500.0, 130.0, 400.0, -130.0), last_ns + 10 * MS, seen(2 * TIMEOUT_NS))
    for name in ("torque_limit_m1_nm", "prbs_limit_nm", "rate_limit_nm_per_s", "sum_limit_nm", "feedback_timeout_s"):
        assert name in str(refusal.value)


def test_a_prbs_may_cross_from_level_to_level_in_one_cycle() -> None:
    guard, now_ns = guard_at(100.0)
    for level_nm in (120.0, -120.0, 120.0, 0.0):
        now_ns += 10 * MS
        m1, _ = guard.check(TorqueRequest(100.0, level_nm, 0.0, 0.0), now_ns, seen(0))
        assert m1.prbs_nm == level_nm


def test_a_torque_moved_from_prbs_to_base_counts_against_the_rate() -> None:
    guard, last_ns = guard_at()
    guard.check(TorqueRequest(0.0, 120.0, 0.0, 0.0), last_ns + 10 * MS, seen(0))
    with pytest.raises(CommandRefused, match="rate_limit_nm_per_s"):
        guard.check(TorqueRequest(120.0, 0.0, 0.0, 0.0), last_ns + 20 * MS, seen(0))


def test_a_stalled_loop_does_not_save_up_allowance() -> None:
    guard, last_ns = guard_at()
    hour_ns = 3600 * 1000 * MS
    with pytest.raises(CommandRefused, match=r"expected a change of at most 100 Nm"):
        guard.check(TorqueRequest(STEP_NM + 1.0, 0.0, 0.0, 0.0), last_ns + hour_ns, seen(0))


@settings(derandomize=True, max_examples=200)
@given(st.lists(st.tuples(st.floats(-1.2, 1.2), st.integers(0, 120 * MS)), min_size=2, max_size=30))
def test_over_any_window_the_base_torque_changes_no_faster_than_the_rate(course: list[tuple[float, int]]) -> None:
    """Steps of up to 1.2 times what the time since the last allows: what is let through keeps to the rate."""
    guard, now_ns = guard_at()
    base_nm, passed = 0.0, [(now_ns, 0.0)]
    for part, dt_ns in course:
        now_ns += dt_ns
        base_nm = max(-300.0, min(300.0, base_nm + part * LIMITS.rate_limit_nm_per_s * dt_ns * 1e-9))
        try:
            guard.check(TorqueRequest(base_nm, 0.0, 0.0, 0.0), now_ns, seen(0))
        except CommandRefused:
            break
        passed.append((now_ns, base_nm))
    for k, (from_ns, from_nm) in enumerate(passed):
        for to_ns, to_nm in passed[k:]:
            allowed_nm = LIMITS.rate_limit_nm_per_s * (to_ns - from_ns) * 1e-9
            assert abs(to_nm - from_nm) <= allowed_nm + len(passed) * ROUNDING_NM


def test_opposite_torques_count_with_their_sign_in_the_sum() -> None:
    guard, last_ns = guard_at(400.0, -300.0)
    guard.check(TorqueRequest(400.0, 0.0, -300.0, 0.0), last_ns + MS, seen(0))


class TestAfterARefusal:
    def refused(self) -> tuple[TorqueGuard, int]:
        guard, last_ns = guard_at(300.0)
        with pytest.raises(CommandRefused):
            guard.check(TorqueRequest(math.nan, 0.0, 0.0, 0.0), last_ns + MS, seen(0))
        return guard, last_ns + MS

    def test_only_zero_passes(self) -> None:
        guard, now_ns = self.refused()
        with pytest.raises(CommandRefused, match="not enabled"):
            guard.check(TorqueRequest(300.0, 0.0, 0.0, 0.0), now_ns + MS, seen(0))
        assert guard.zero()[0].base_nm == 0.0

    def test_the_way_back_starts_at_zero(self) -> None:
        guard, now_ns = self.refused()
        guard.enable()
        with pytest.raises(CommandRefused, match="from 0 Nm to 300 Nm in 0 s"):
            guard.check(TorqueRequest(300.0, 0.0, 0.0, 0.0), now_ns + 1000 * MS, seen(0))

    def test_after_enable_zero_sets_the_time_the_rate_counts_from(self) -> None:
        guard, now_ns = self.refused()
        guard.enable()
        guard.check(TorqueRequest(0.0, 0.0, 0.0, 0.0), now_ns, seen(0))
        guard.check(TorqueRequest(20.0, 0.0, 0.0, 0.0), now_ns + 10 * MS, seen(0))
        with pytest.raises(CommandRefused, match="rate_limit"):
            guard.check(TorqueRequest(40.1, 0.0, 0.0, 0.0), now_ns + 20 * MS, seen(0))


@pytest.mark.parametrize("silence", ["disable", "zero", "enable"])
def test_whatever_sends_zero_forgets_the_base_torque(silence: str) -> None:
    guard, last_ns = guard_at(300.0)
    getattr(guard, silence)()
    guard.enable()
    with pytest.raises(CommandRefused, match="from 0 Nm to 300 Nm"):
        guard.check(TorqueRequest(300.0, 0.0, 0.0, 0.0), last_ns + MS, seen(0))


def test_zero_leaves_the_guard_enabled_and_disable_does_not() -> None:
    guard, last_ns = guard_at(100.0)
    guard.zero()
    guard.check(TorqueRequest(0.0, 60.0, 0.0, 0.0), last_ns + MS, seen(0))
    guard.disable()
    with pytest.raises(CommandRefused, match="not enabled"):
        guard.check(TorqueRequest(0.0, 60.0, 0.0, 0.0), last_ns + 2 * MS, seen(0))


def test_a_command_cannot_be_built_outside_the_guard() -> None:
    with pytest.raises(CommandRefused, match="built outside the guard"):
        GuardedTorque(10.0, 0.0, object())  # type: ignore[arg-type]
    with pytest.raises(TypeError):
        GuardedTorque(10.0, 0.0)  # type: ignore[call-arg]


def test_a_command_cannot_be_turned_into_another() -> None:
    command, _ = TorqueGuard(LIMITS).zero()
    with pytest.raises(dataclasses.FrozenInstanceError):
        command.base_nm = 10.0  # type: ignore[misc]
    with pytest.raises(ValueError, match="seal"):
        dataclasses.replace(command, base_nm=10.0)
    assert copy.copy(command) == command


NO_LIMITS = [
    (field.name, value)
    for field in dataclasses.fields(GuardLimits)
    for value in (0.0, -1.0, math.nan, math.inf)
    if field.name != "error" and (field.name, value) != ("speed_limit_rad_s", math.inf)
]


@pytest.mark.parametrize(("name", "value"), NO_LIMITS)
def test_a_limit_that_limits_nothing_is_refused(name: str, value: float) -> None:
    with pytest.raises(ConfigMismatch, match=f"{name} is {value}"):
        dataclasses.replace(LIMITS, **{name: value})


@pytest.mark.parametrize("name", [field.name for field in dataclasses.fields(ErrorLimits)])
@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
def test_an_error_that_is_no_limit_is_refused(name: str, value: float) -> None:
    with pytest.raises(ConfigMismatch, match=f"torque error: .*{name} is {value}"):
        dataclasses.replace(LIMITS.error, **{name: value})


def test_a_speed_limit_may_be_left_to_the_plc() -> None:
    guard = TorqueGuard(dataclasses.replace(LIMITS, speed_limit_rad_s=math.inf))
    guard.enable()
    guard.check(TorqueRequest(0.0, 60.0, 0.0, 0.0), 0, seen(0, 0, 1e6))
    with pytest.raises(CommandRefused, match="speed_limit_rad_s"):
        guard.check(TorqueRequest(0.0, 60.0, 0.0, 0.0), 0, seen(0, 0, math.nan))


def test_limits_and_requests_can_t_be_changed_afterwards() -> None:
    guard = TorqueGuard(LIMITS)
    with pytest.raises(dataclasses.FrozenInstanceError):
        guard.limits.sum_limit_nm = 9999.0  # type: ignore[misc]
    with pytest.raises(AttributeError):
        guard.limits = LIMITS  # type: ignore[misc]
    with pytest.raises(dataclasses.FrozenInstanceError):
        HOLD.base_m1_nm = 9999.0  # type: ignore[misc]


@pytest.mark.parametrize("kind", [GuardLimits, ErrorLimits, Evidence, TorqueRequest, GuardedTorque, torque_guard._Past])
def test_what_the_guard_judges_by_can_t_be_changed(kind: type) -> None:
    assert kind.__dataclass_params__.frozen


def boundary_values(limit: float) -> list[float]:
    """Values dense near a limit and zero, sparse elsewhere, on both sides."""
    close = [limit + k * BEYOND_NM for k in range(-5, 6)]
    sparse = [limit * k / 10.0 for k in range(21)]
    return [sign * value for value in (0.0, *close, *sparse) for sign in (1.0, -1.0)]


@pytest.mark.parametrize("inverter", ["m1", "m2"])
def test_scan_of_the_prbs_around_its_limit(inverter: str) -> None:
    for value in boundary_values(LIMITS.prbs_limit_nm):
        guard, last_ns = guard_at()
        request = dataclasses.replace(TorqueRequest(0.0, 0.0, 0.0, 0.0), **{f"prbs_{inverter}_nm": value})
        if abs(value) <= LIMITS.prbs_limit_nm:
            guard.check(request, last_ns + MS, seen(0))
        else:
            with pytest.raises(CommandRefused, match="prbs_limit_nm"):
                guard.check(request, last_ns + MS, seen(0))


@pytest.mark.parametrize(("inverter", "limit"), [("m1", 400.0), ("m2", 300.0)])
def test_scan_of_the_torque_around_its_limit(inverter: str, limit: float) -> None:
    for value in boundary_values(limit):
        base_nm = math.copysign(max(abs(value) - 50.0, 0.0), value)
        guard, last_ns = guard_at(**{f"base_{inverter}_nm": max(-limit + 50, min(limit - 50, base_nm))})
        parts = {f"base_{inverter}_nm": base_nm, f"prbs_{inverter}_nm": value - base_nm}
        request = dataclasses.replace(TorqueRequest(0.0, 0.0, 0.0, 0.0), **parts)
        if abs(value) <= limit:
            guard.check(request, last_ns + PERIOD_NS, seen(0))
        else:
            with pytest.raises(CommandRefused, match=f"torque_limit_{inverter}_nm"):
                guard.check(request, last_ns + PERIOD_NS, seen(0))


torques = st.one_of(st.sampled_from([0.0, 0.0, 10.0, -10.0, 60.0, -60.0]), st.floats(-150.0, 150.0))
requests = st.builds(TorqueRequest, torques, torques, torques, torques)
steps = st.tuples(requests, st.integers(0, 200 * MS), st.integers(0, 60 * MS))


@settings(derandomize=True, max_examples=200)
@given(st.lists(steps, max_size=8))
def test_whatever_is_asked_what_comes_out_is_within_every_limit(course: list[tuple[TorqueRequest, int, int]]) -> None:
    guard = TorqueGuard(LIMITS)
    now_ns, before = 0, TorqueRequest(0.0, 0.0, 0.0, 0.0)
    for request, dt_ns, age_ns in course:
        if not guard.enabled:
            guard.enable()
            before = TorqueRequest(0.0, 0.0, 0.0, 0.0)
        now_ns += dt_ns
        try:
            m1, m2 = guard.check(request, now_ns, seen(age_ns))
        except CommandRefused:
            continue
        slack = 2 * ROUNDING_NM
        counted_s = min(dt_ns * 1e-9, LIMITS.period_s)
        largest_step_nm = LIMITS.rate_limit_nm_per_s * counted_s + 2 * LIMITS.prbs_limit_nm + slack
        assert (m1.base_nm, m1.prbs_nm, m2.base_nm, m2.prbs_nm) == dataclasses.astuple(request)
        assert abs(request.total_m1_nm) <= LIMITS.torque_limit_m1_nm + slack
        assert abs(request.total_m2_nm) <= LIMITS.torque_limit_m2_nm + slack
        assert abs(request.total_m1_nm + request.total_m2_nm) <= LIMITS.sum_limit_nm + slack
        assert abs(request.total_m1_nm - before.total_m1_nm) <= largest_step_nm
        assert abs(request.total_m2_nm - before.total_m2_nm) <= largest_step_nm
        assert age_ns <= TIMEOUT_NS
        before = request


ROOT = Path(__file__).resolve().parents[2]

OPENING = """
from drivers.torque_guard import Evidence, GuardedTorque, TorqueGuard, TorqueRequest

def send(torque: GuardedTorque) -> None: ...

def run(guard: TorqueGuard, request: TorqueRequest) -> None:
"""


@pytest.fixture(scope="module")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("mypy_cache")


def type_check(line: str, folder: Path, cache: Path) -> str:
    program = folder / "program.py"
    program.write_text(f"{OPENING}    {line}\n")
    command = [sys.executable, "-m", "mypy", "--config-file=", "--strict", f"--cache-dir={cache}", str(program)]
    environment = {**os.environ, "MYPYPATH": str(ROOT)}
    return subprocess.run(command, capture_output=True, text=True, env=environment, check=False).stdout


def test_what_the_guard_returns_type_checks(tmp_path: Path, cache: Path) -> None:
    assert "Success" in type_check("send(guard.check(request, 0, Evidence(0, 0, 0.0))[0])", tmp_path, cache)


@pytest.mark.parametrize(
    ("line", "complaint"),
    [
        ("send(12.0)", 'incompatible type "float"'),
        ("send(request)", 'incompatible type "TorqueRequest"'),
        ("send(GuardedTorque(12.0, 0.0))", 'Missing positional argument "seal"'),
        ("send(GuardedTorque(12.0, 0.0, object()))", 'incompatible type "object"; expected "_Seal"'),
        ("guard.zero()[0].base_nm = 12.0", "is read-only"),
    ],
)
def test_a_way_round_the_guard_does_not(line: str, complaint: str, tmp_path: Path, cache: Path) -> None:
    assert complaint in type_check(line, tmp_path, cache)
