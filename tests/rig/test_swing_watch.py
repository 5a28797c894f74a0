"""The watch of a damper: a loop that damps is left alone, one with more dead time than designed is switched off."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm

from estimator.signals.prbs import Prbs
from hil.errors import RunAborted
from hil.rig.experiments.base import Phase
from tests.rig.test_damper import CONTENT, SAMPLE, damping

LINE = CONTENT["line"]


def loop(late: int, seconds: float, ends_run: bool = False, knock_nm: float = 0.0) -> tuple[str, float]:
    """Close the loop by the design's own line, its torque so many cycles later; why it went off, and the last swing."""
    one, prbs = damping(), Prbs(120.0, 10, 2, 1)
    one.ends_run = ends_run
    a = np.zeros((4, 4))
    a[0] = -(LINE["b_M"] + LINE["c"]), LINE["c"], -LINE["k"], 1.0
    a[0] /= LINE["J_M"]
    a[1, :3] = np.array([LINE["c"], -(LINE["b_L"] + LINE["c"]), LINE["k"]]) / LINE["J_L"]
    a[2, :2] = 1.0, -1.0
    held = expm(0.01 * a)
    state, waiting, noise = np.zeros(3), [0.0] * (late + 1), np.random.default_rng(1)
    speeds = []
    for k in range(round(100 * seconds)):
        prbs_nm = prbs.next()
        damping_nm = one.torque_nm(k)
        waiting.append(damping_nm)
        sample = replace(SAMPLE, cycle=k, time_s=0.01 * k, prbs_nm=prbs_nm, torque_ref_m1_nm=prbs_nm + damping_nm)
        one(replace(sample, speed_rad_s=state[0] + 0.05 * noise.standard_normal()), Phase.MEASURE)
        knocked = knock_nm if 300 <= k < 320 else 0.0
        state = held[:3, :3] @ state + held[:3, 3] * (prbs_nm + waiting[-1 - late] + knocked)
        speeds.append(state[0] - state[1])
    return one.off, float(np.std(speeds[-100:]))


@pytest.mark.parametrize("knock_nm", [0.0, 400.0])
def test_a_damper_that_damps_is_left_alone(knock_nm: float) -> None:
    assert loop(0, 20.0, knock_nm=knock_nm)[0] == ""


@pytest.mark.parametrize("late", [2, 3, 4, 5, 6])
def test_dead_time_that_makes_it_swing_switches_it_off(late: int) -> None:
    off, _ = loop(late, 20.0)
    assert "the shaft swings by" in off
    assert float(off.split()[1]) < (10.0 if late == 2 else 3.0), "with two cycles it grows slowly"


def test_the_rig_file_may_have_the_run_ended_by_it() -> None:
    with pytest.raises(RunAborted, match=r"damper: switched off at .*the shaft swings by"):
        loop(4, 20.0, ends_run=True)
