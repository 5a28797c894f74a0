"""Where each parameter stands in the kernel's vector, and what stands there without it."""

from __future__ import annotations

from estimator.physics.catalogue import EFFECTS
from estimator.physics.layout import LOAD, NOMINAL, SIZE, flat, slot
from tests.estimator.physics.bench import ONE_MASS, TWO_MASS, model


class TestLayout:
    def test_every_parameter_has_a_slot_of_its_own(self) -> None:
        slots = [slot("", name) for name in (*NOMINAL, LOAD)]
        slots += [slot(entry.name, p.name) for entry in EFFECTS.values() for p in entry.parameters]
        assert sorted(slots) == list(range(SIZE))

    def test_a_smaller_structure_leaves_the_rest_at_zero(self) -> None:
        vector = flat(model(ONE_MASS))
        assert vector[slot("", "J_M")] == ONE_MASS["J_M"]
        assert [vector[slot("", name)] for name in ("J_L", "k", "c", "b_L")] == [0.0] * 4

    def test_effects_are_at_their_null_unless_the_model_has_them(self) -> None:
        vector = flat(model(TWO_MASS, effects={"backlash": {"gap_rad": 0.03}}))
        assert vector[slot("backlash", "gap_rad")] == 0.03
        assert vector[slot("backlash", "contact_rad")] == 0.0
        assert vector[slot("stiffness_nonlinearity", "shape")] == 1.0
