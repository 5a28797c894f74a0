"""What a machine has decides which effects are candidates: of parts that it has not, nothing can be missing."""

from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.inference.hypotheses import open_hypotheses
from estimator.physics.catalogue import EFFECTS
from estimator.physics.machine import PARTS
from estimator.signals.record import OutputKind
from tests.estimator.physics.bench import TWO_MASS, linear_record, model, random_steps
from tests.estimator.physics.test_unknowns import CRUISE

REC = linear_record(TWO_MASS, random_steps(2000, seed=1), CRUISE)
TWO_INPUTS = replace(REC, torque_nm=np.column_stack([REC.total_torque_nm, 0.3 * np.roll(REC.total_torque_nm, 100)]))
OF_PARTS = frozenset().union(*PARTS.values())


def candidates(has: frozenset[str] | None, *records: object) -> set[str]:
    testable, untestable = open_hypotheses(replace(model(TWO_MASS), has=has), records)  # type: ignore[arg-type]
    return {*testable, *untestable}


def test_every_part_is_of_effects_that_there_are() -> None:
    assert set(EFFECTS) >= OF_PARTS


@pytest.mark.parametrize("part", PARTS)
def test_only_effects_of_parts_that_the_machine_has_are_candidates(part: str) -> None:
    everything = candidates(frozenset(PARTS), TWO_INPUTS)
    assert everything >= OF_PARTS
    assert candidates(frozenset(PARTS) - {part}, TWO_INPUTS) == everything - PARTS[part]
    assert candidates(frozenset(), TWO_INPUTS) == everything - OF_PARTS


def test_signals_imply_what_nobody_says() -> None:
    assert candidates(None, TWO_INPUTS) == candidates(frozenset(PARTS), TWO_INPUTS)
    of_one_input = candidates(None, TWO_INPUTS) - {"generator_coupled", "inverter_gain_mismatch"}
    assert candidates(None, REC) == of_one_input
    axis = candidates(None, replace(TWO_INPUTS, kind=OutputKind.POSITION))
    assert axis & OF_PARTS == {"inertia_change"}
