"""However it is shared, the total is what was asked for."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hil.rig.excitation import Split

shares = st.floats(0.0, 1.0)
torques = st.floats(-1e3, 1e3)


@given(shares, shares, torques, torques)
def test_total_is_kept(base_m1: float, prbs_m1: float, base_nm: float, prbs_nm: float) -> None:
    request = Split(base_m1, prbs_m1).request(base_nm, prbs_nm)
    assert request.base_m1_nm + request.base_m2_nm == pytest.approx(base_nm, abs=1e-9)
    assert request.prbs_m1_nm + request.prbs_m2_nm == pytest.approx(prbs_nm, abs=1e-9)


def test_one_inverter_alone_can_carry_the_prbs() -> None:
    request = Split(base_m1=0.5, prbs_m1=0.0).request(100.0, 40.0)
    assert (request.total_m1_nm, request.total_m2_nm) == (50.0, 90.0)


def test_larger_base_share() -> None:
    assert Split(0.3, 0.5).largest_base_share == 0.7
