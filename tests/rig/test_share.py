"""The part of the base torque that inverter m1 gives: each experiment's own."""

from pathlib import Path

import pytest

from hil.config.rig_file import read_rig
from hil.errors import HilError
from hil.rig.plan import plan_run

RIG = Path("examples/rig.toml")


def test_the_inverters_share_the_base_torque_as_the_experiment_says() -> None:
    rig = read_rig(RIG)
    shares = {name: plan_run(rig, name).split.base_m1 for name in rig.experiments}
    assert shares == {"cruise": 0.5, "reversal": 0.65, "tip": 0.35}
    request = plan_run(rig, "reversal").split.request(200.0, 40.0)
    assert (request.base_m1_nm, request.base_m2_nm) == pytest.approx((130.0, 70.0))
    assert (request.prbs_m1_nm, request.prbs_m2_nm) == pytest.approx((20.0, 20.0))  # the PRBS has a share of its own


def test_a_share_beyond_all_of_it_is_refused_with_its_key(tmp_path: Path) -> None:
    path = tmp_path / "rig.toml"
    path.write_text(RIG.read_text().replace("share_m1 = 0.65", "share_m1 = 1.65"))
    with pytest.raises(HilError, match=r"experiments\.reversal.*share_m1"):
        read_rig(path)
