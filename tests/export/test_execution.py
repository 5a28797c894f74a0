"""The exported text, executed, is the estimator of the host: every number, to the bit."""

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from estimator.identification.chain import OnlineTrajectory
from estimator.identification.linear_model import Orders
from estimator.identification.online.recursive import Status, Trajectory
from estimator.identification.settings import Settings
from estimator.signals.record import FloatArray
from hil.export.plc_estimator import PROFILES, PlcEstimator, profile
from hil.export.structured_text import Precision
from tests.chosen import campaign, one_in
from tests.estimator.identification.tracking import roads
from tests.export.drives import bad_drive, clean_drive, still_drive
from tests.export.iec.machine import Machine
from tests.export.plc_runs import (
    Cycles,
    Kept,
    assert_equal_bits,
    execute,
    execute_oefo,
    exported,
    on_host,
    on_plc,
    summed,
)

RESONANCE = np.poly([0.85 * np.exp(1.0j), 0.85 * np.exp(-1.0j)]).real
"""A filter near the bus's own: 8 Hz at 20 ms is 1.0 rad per sample."""

TRACE_REACHED = "decreasing_then_constant_trace:trace=1.0"
"""The paper's profile with a trace that so short a drive comes down to."""


@pytest.mark.parametrize(
    "drive", [campaign(clean_drive()), bad_drive(), campaign(still_drive())], ids=["clean", "bad", "still"]
)
@pytest.mark.parametrize("L", [RESONANCE, np.ones(1), None], ids=["fixed", "none", "adapted"])
def test_every_number_is_the_hosts_to_the_bit(drive: Cycles, L: FloatArray | None, tmp_path: Path) -> None:
    estimator = PlcEstimator(L=L)
    assert_equal_bits(on_plc(estimator, drive, tmp_path), on_host(estimator, drive))


@pytest.mark.parametrize(
    ("orders", "cycle_s", "sample_time_s"),
    [
        (Orders(4, 4, 1), 0.02, 0.02),  # nothing to decimate: a low-pass of one tap
        (Orders(2, 3, 0), 0.01, 0.02),
        campaign((Orders(3, 2, 5), 0.005, 0.02)),
        (Orders(0, 6, 1), 0.01, 0.01),  # no poles at all
        pytest.param(Orders(1, 1, 1), 0.01, 0.04, marks=pytest.mark.campaign),
        pytest.param(Orders(7, 5, 2), 0.01, 0.02, marks=pytest.mark.campaign),
    ],
    ids=str,
)
def test_orders_delay_and_periods_are_free(
    orders: Orders, cycle_s: float, sample_time_s: float, tmp_path: Path
) -> None:
    estimator = PlcEstimator(Settings(orders=orders, sample_time_s=sample_time_s), cycle_s)
    assert_equal_bits(on_plc(estimator, bad_drive(), tmp_path), on_host(estimator, bad_drive()))


@pytest.mark.parametrize("name", one_in(3, PROFILES))
def test_every_adaptation_profile(name: str, tmp_path: Path) -> None:
    estimator = PlcEstimator(Settings(adaptation=profile(name)), L=RESONANCE)
    assert_equal_bits(on_plc(estimator, bad_drive(), tmp_path), on_host(estimator, bad_drive()))


@pytest.mark.parametrize("L", [RESONANCE, None], ids=["fixed", "adapted"])
def test_the_estimator_alone_without_the_decimator_to_hold_bad_values(L: FloatArray | None, tmp_path: Path) -> None:
    estimator = PlcEstimator(Settings(adaptation=profile(TRACE_REACHED)), L=L)
    u, y, okay = summed(bad_drive())
    plc = execute_oefo(exported(estimator), u, y, okay, tmp_path)
    assert_equal_bits(plc, estimator.oefo().run(u, y, okay))


def off_at_times(time_s: float) -> float:
    return 0.0 if 20.0 <= time_s < 35.0 or time_s > 55.0 else 120.0


def on_the_road(prbs_nm: Callable[[float], float]) -> Cycles:
    record = roads.drive(5, 65.0, prbs_nm).record
    return Cycles(record.torque_nm[:, 0].copy(), record.torque_nm[:, 1].copy(), record.output.copy(), record.okay)


@pytest.mark.parametrize("prbs_nm", [off_at_times, lambda time_s: 0.0], ids=["on and off", "never"])
@pytest.mark.parametrize("profile_name", ["decreasing_then_constant_trace", "constant_forgetting:lambda1=0.995"])
def test_excitation_hold_and_restart_are_the_hosts(
    prbs_nm: Callable[[float], float], profile_name: str, tmp_path: Path
) -> None:
    drive = on_the_road(prbs_nm)
    drive.speed_rad_s[4000:4003] = np.nan
    estimator = PlcEstimator(Settings(adaptation=profile(profile_name)))
    plc = on_plc(estimator, drive, tmp_path)
    assert_equal_bits(plc, on_host(estimator, drive))
    assert np.count_nonzero(plc.status == 3) > 400  # not excited, and it says so


def test_the_example_program_keeps_the_last_estimate_that_may_be_used(tmp_path: Path) -> None:
    drive, estimator = clean_drive(), PlcEstimator(L=RESONANCE)
    machine = Machine(exported(estimator), "PRG_HilExample", tmp_path)
    for m1, m2, speed, okay in zip(*vars(drive).values(), strict=True):
        out = machine(torqueM1=m1, torqueM2=m2, speed=speed, fresh=bool(okay), seriesMode=True, clutchOpen=True)
    host = on_host(estimator, drive)
    theta = host.estimates.theta
    estimated = [k for k in range(len(host)) if host[k].status is Status.ESTIMATED]
    assert out.estimates == len(estimated) > 100
    assert [*out.theta] == theta[estimated[-1]].tolist()


def test_what_is_undetermined_is_named_as_on_the_host(tmp_path: Path) -> None:
    for drive, expected in ((clean_drive(), False), (still_drive(), True)):
        estimator = PlcEstimator(L=RESONANCE)
        host = estimator.oefo()
        kept = estimator.decimator().run(*summed(drive))
        host.run(kept.u, kept.y, kept.okay)
        weak = on_plc(estimator, drive, tmp_path).undetermined[-1]
        names = np.array(estimator.settings.orders.names)[weak].tolist()
        assert names == list(host.undetermined)
        assert bool(names) is expected


@pytest.mark.parametrize("L", [RESONANCE, None], ids=["fixed", "adapted"])
def test_in_single_precision_no_number_is_lost_and_the_model_is_the_same(L: FloatArray | None, tmp_path: Path) -> None:
    estimator, drive = PlcEstimator(L=L), bad_drive()
    plc, host = on_plc(estimator, drive, tmp_path, Precision.SINGLE), on_host(estimator, drive)
    assert np.isfinite(plc.theta).all()
    assert np.isfinite(plc.errors).all()
    assert np.array_equal(plc.used, host.estimates.used)
    model = estimator.oefo().model(0.02)
    frequency_hz = np.linspace(2.0, 25.0, 50)
    single, double = (
        type(model).from_theta(theta.astype(float), model.orders, 0.02).response(frequency_hz)
        for theta in (plc.theta[-1], host.estimates.theta[-1])
    )
    # A hundredth of the 1 dB the two estimates of one drive may differ by: rounding must not count next to noise.
    assert np.abs(20.0 * np.log10(np.abs(single / double))).max() < 0.01 * 1.0


MUTANTS = (
    ("windowOutput[1] := heldOutput - meanOutput", "windowOutput[1] := heldOutput"),
    ("(contamination > UNTRUSTED)", "(contamination > 2.0 * UNTRUSTED)"),
    ("WHILE i >= 2 DO\n    windowTorque", "WHILE i >= 3 DO\n    windowTorque"),
    ("IF spoilt > 0 THEN", "IF spoilt > 1 THEN"),
    ("heldCount := heldCount - 1", "heldCount := 0"),
    ("IF ABS(speed) > peak THEN", "IF speed > peak THEN"),
    ("heldCount := NK + NB", "heldCount := NK"),
    ("phi[NA + j] := pastIn[NK + j]", "phi[NA + j] := pastIn[j]"),
    ("phi[i] := -pastOut[i]", "phi[i] := pastOut[i]"),
    ("IF usedCount < START_UP", "IF usedCount <= START_UP"),
    ("ePost := ePrior / (1.0 + gainF.quad)", "ePost := ePrior / (2.0 + gainF.quad)"),
    ("facV[i, j] := element - product[i] * share", "facV[i, j] := element - product[j] * share"),
    ("facE[j] := facE[j] * (before * weight)", "facE[j] := facE[j] * before * weight"),
    ("before := alpha", "before := lambda1Now"),
    ("scale := traceHeld / traceF", "scale := 1.0"),
    ("(mirror > -1.0) AND (mirror < 1.0)", "(mirror > -1.0)"),
    ("(mirror > -1.0) AND (mirror < 1.0)", "(mirror < 1.0)"),
    ("IF stable AND ADAPT_FILTER", "IF ADAPT_FILTER"),
    ("WHILE i <= m / 2 DO", "WHILE i <= (m - 1) / 2 DO"),
    ("torque := torqueM1 + torqueM2", "torque := torqueM1"),
    ("heardTwRe := part + heardOnRe", "heardTwRe := part"),
    ("zeta := -aRe / magnitude", "zeta := aRe / magnitude"),
)
"""What stands in the text, and what is put in its place."""


SETTINGS = Settings(adaptation=profile("decreasing_then_constant_trace:trace=1.0"))


@pytest.mark.parametrize(
    ("before", "after"),
    [pytest.param(*each, marks=[pytest.mark.campaign] * bool(number % 12)) for number, each in enumerate(MUTANTS)],
)
def test_a_fault_in_the_text_is_noticed(before: str, after: str, tmp_path: Path) -> None:
    assert any(not same_bits(plc, host) for plc, host in both_sides(before, after, tmp_path))


def both_sides(before: str, after: str, folder: Path) -> Iterator[tuple[Kept, Trajectory | OnlineTrajectory]]:
    """Yield what the text with a fault and the host make of a drive, until the fault has been noticed."""
    drive = bad_drive()
    for L in (np.array([1.0, -0.9, 0.72]), None):
        estimator = PlcEstimator(SETTINGS, L=L)
        text = exported(estimator)
        assert before in text
        wrong = text.replace(before, after)
        yield execute(wrong, drive, folder), on_host(estimator, drive)
        yield execute_oefo(wrong, *summed(drive), folder), estimator.oefo().run(*summed(drive))
    at_times, estimator = on_the_road(off_at_times), PlcEstimator(SETTINGS)  # for what decides on the excitation
    yield execute(exported(estimator).replace(before, after), at_times, folder), on_host(estimator, at_times)


def same_bits(plc: Kept, host: Trajectory | OnlineTrajectory) -> bool:
    try:
        assert_equal_bits(plc, host)
    except AssertionError:
        return False
    return True
