"""Runs as steps order them: what an experiment of the rig file keeps, and what the order says in its place."""

import pytest

from hil.orders.order import RigSource, as_table, cruise_of, halt
from tests.design.test_candidates import EXAMPLE

OWN = {
    "amplitude and clock": "prbs_amplitude_nm = 50.0\nprbs_clock_divider = 3\n",
    "multi-sine": "multisine = { period_s = 10.0, lowest_hz = 0.5, highest_hz = 15.0, amplitude_nm = 60.0 }\n",
}
SLEW = "torque_nm = 500.0\nslew_nm_per_s = 1000.0\n"


@pytest.mark.parametrize("own", OWN.values(), ids=OWN)
def test_an_order_says_what_excites_whatever_the_cruise_has_of_its_own(own: str) -> None:
    text = EXAMPLE.read_text("utf-8").replace(SLEW, SLEW + own, 1)
    source = RigSource(EXAMPLE, text)
    cruise = cruise_of(source.rig())
    assert source.rig().excitation_nm(cruise) in (50.0, 60.0)  # as the user drives it

    rig, _ = source.ordered(halt(source.rig()))
    assert rig.excitation_nm(rig.experiments["halt"]) == 0.0

    excited = as_table(cruise, prbs=True)
    assert not {"prbs_amplitude_nm", "prbs_clock_divider", "multisine"} & set(excited)
