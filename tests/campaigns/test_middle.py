"""The man in the middle: the judge finds what is wrong, and leaves alone what is not."""

import re
from pathlib import Path

import pytest

from tests.campaigns.faults.middle import INERTIA_KG_M2, run_with
from tests.campaigns.faults.middle_kinds import Fault
from tests.campaigns.faults.rig import campaign_rig


@pytest.mark.parametrize(
    ("kind", "ends"),
    [
        ("none", ""),
        ("leaves operation", "power state is"),
        ("speed zero", "expected one speed"),
        ("boot-up", "NMT"),
        ("two hosts at once", "somebody else|[Aa]nother host"),
        ("PLC registers exchanged", "PLC"),
        ("EMCY reset at once", "EMCY 0x2310 .*, and its end"),
        ("limit bit, some counts", "bit 11"),
        ("stuck at another torque, frozen", "torque actual value"),
        ("slow slope: stuck", "torque actual value"),
        ("both speeds reversed", "velocity|0x606C"),
    ],
)
def test_a_fault_ends_the_run_and_none_does_not(kind: str, ends: str, tmp_path: Path) -> None:
    fault = Fault(kind, 1, 100, "for ever", 1, 1, 0.0)
    outcome, _ = run_with(campaign_rig(tmp_path, inertia_kg_m2=INERTIA_KG_M2), "tip", fault, tmp_path, 5.0)
    assert outcome.problems == []
    assert re.search(ends, outcome.said)
    assert bool(outcome.said) is bool(ends)


def test_a_torque_that_nobody_can_see_is_a_failure(tmp_path: Path) -> None:
    """Exchanged in both directions each drive answers for the other: for commissioning to find."""
    fault = Fault("node ids exchanged", 1, 100, "for ever", 1, 1, 0.0)
    outcome, _ = run_with(campaign_rig(tmp_path, inertia_kg_m2=INERTIA_KG_M2), "tip", fault, tmp_path, 5.0)
    assert any("was wrong by" in problem for problem in outcome.problems)
