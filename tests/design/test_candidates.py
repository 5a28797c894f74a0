"""What a rig may drive next: within its limits, through its guard, and as a table that ``hil run`` takes."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from estimator.signals.multisine import Lines, Multisine, crest_factor, excited_lines, multisine_nm
from hil.config.rig_file import read_rig, with_experiment_of
from hil.design.candidates import Limits, candidates
from hil.design.design import on_paper
from hil.errors import HilError, RigFileError, UsageError
from hil.orders.order import Order, RigSource
from hil.orders.runner import rigid_model
from hil.rig.plan import plan_run
from tests.rig.serving import EXAMPLE

SOURCE = RigSource(EXAMPLE, EXAMPLE.read_text(encoding="utf-8"))
NEXT = '[experiments.next_1]\nkind = "coast"\nspeed_rad_s = 20.0\nduration_s = 5.0\ntorque_nm = 300.0\n'
NEXT += "slew_nm_per_s = 900.0\n"


def rig_with(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "rig.toml"
    path.write_text(SOURCE.text + text, encoding="utf-8")
    return path


def test_limits_are_those_of_the_files_own_experiments() -> None:
    assert Limits.of(SOURCE.rig()) == Limits(500.0, 3000.0, 60.0, 30.0, math.inf)


def test_limits_that_are_given_count(tmp_path: Path) -> None:
    rig = read_rig(rig_with(tmp_path, "\n[design]\nmost_torque_nm = 200.0\nmost_angle_rad = 40.0\n"))
    assert Limits.of(rig) == Limits(200.0, 3000.0, 60.0, 30.0, 40.0)


def test_a_rig_that_says_nothing_of_its_limits_is_asked_for_them() -> None:
    rig = SOURCE.rig().model_copy(update={"experiments": {}})
    with pytest.raises(UsageError, match="most_torque_nm"):
        Limits.of(rig)


def test_most_of_what_is_proposed_passes_guard_and_limits() -> None:
    rig = SOURCE.rig()
    limits, model = Limits.of(rig), rigid_model(rig)
    passed = []
    for name, table in list(candidates(rig, limits))[::4]:
        try:
            planned = on_paper(SOURCE, name, table, model, limits)
        except HilError:
            continue
        assert planned.largest_nm <= rig.guard.sum_limit_nm
        assert max(map(abs, planned.speed_rad_s)) <= 1.2 * limits.speed_rad_s
        passed.append(name)
    assert len(passed) >= 6


def test_a_file_with_one_experiment_is_driven_with_the_rig(tmp_path: Path) -> None:
    """Its table is in the text that a recording keeps of the rig file."""
    file = tmp_path / "next.toml"
    file.write_text(NEXT, encoding="utf-8")
    rig, text, name = with_experiment_of(EXAMPLE, str(file))
    assert (name, rig.experiments[name].kind) == ("next_1", "coast")
    assert text is not None
    assert "[experiments.next_1]" in text
    assert with_experiment_of(EXAMPLE, "cruise")[1:] == (None, "cruise")
    assert "next_1" in read_rig(rig_with(tmp_path, "\n" + NEXT)).experiments


@pytest.mark.parametrize(
    ("text", "message"),
    [("", "expected one table"), (NEXT.replace("next_1", "cruise"), "a name that .* does not have")],
)
def test_a_file_that_has_not_one_experiment_is_refused(tmp_path: Path, text: str, message: str) -> None:
    file = tmp_path / "next.toml"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(RigFileError, match=message):
        with_experiment_of(EXAMPLE, str(file))


@pytest.mark.parametrize("lines", Lines)
def test_a_multisine_has_power_at_its_lines_alone_and_no_high_peak(lines: Lines) -> None:
    excited = excited_lines(1000, 0.01, 0.5, 30.0, lines, 3)
    signal = multisine_nm(1000, excited, 80.0)
    power = np.abs(np.fft.rfft(signal))
    assert np.abs(signal).max() == pytest.approx(80.0)
    assert crest_factor(signal) <= 2.0
    assert np.flatnonzero(power > 1e-6 * power.max()).tolist() == excited.tolist()
    assert power[excited] == pytest.approx(power[excited][0])
    assert lines is Lines.FULL or np.all(excited % 2 == 1)


def test_one_line_in_four_is_left_out_to_detect_distortion() -> None:
    odd, kept = (set(excited_lines(1000, 0.01, 0.5, 30.0, each, 3)) for each in (Lines.ODD, Lines.ODD_RANDOM))
    assert kept < odd
    assert len(odd - kept) == len(odd) // 4


MULTISINE = "multisine = {{ amplitude_nm = {}, period_s = 5.0, lowest_hz = 0.5, highest_hz = {} }}\n"


def cruise(tmp_path: Path, keys: str) -> Path:
    table = '\n[experiments.mine]\nkind = "cruise"\nspeed_rad_s = 20.0\nduration_s = 10.0\ntorque_nm = 300.0\n'
    return rig_with(tmp_path, table + "slew_nm_per_s = 900.0\n" + keys)


def test_an_experiment_has_an_excitation_of_its_own(tmp_path: Path) -> None:
    sine = plan_run(read_rig(cruise(tmp_path, MULTISINE.format(100.0, 20.0))), "mine")
    assert isinstance(sine.prbs, Multisine)
    prbs = plan_run(read_rig(cruise(tmp_path, "prbs_amplitude_nm = 60.0\nprbs_clock_divider = 5\n")), "mine")
    levels = [prbs.prbs.next() for _ in range(500)]
    assert set(np.abs(levels)) == {60.0}
    assert np.count_nonzero(np.diff(levels)) <= 100


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        (MULTISINE.format(300.0, 20.0), "amplitude_nm"),
        (MULTISINE.format(100.0, 60.0), "below half the sampling rate"),
        (MULTISINE.format(100.0, 0.6), "at least 2 of its lines"),
        ("prbs_amplitude_nm = 500.0\n", "prbs_limit_nm"),
        ("prbs = false\nprbs_clock_divider = 2\n", "without a PRBS"),
    ],
)
def test_an_excitation_beyond_guard_or_band_is_refused_by_its_key(tmp_path: Path, keys: str, message: str) -> None:
    with pytest.raises(RigFileError, match=message):
        read_rig(cruise(tmp_path, keys))


def test_an_order_may_have_an_excitation_of_its_own() -> None:
    table = {"kind": "cruise", "speed_rad_s": 20.0, "duration_s": 10.0, "torque_nm": 300.0, "slew_nm_per_s": 900.0}
    rig, text = SOURCE.ordered(Order("next", {**table, "prbs_amplitude_nm": 60.0}))
    assert rig.excitation_nm(rig.experiments["next"]) == 60.0
    assert "prbs_amplitude_nm = 60.0" in text
