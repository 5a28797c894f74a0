"""A law without a name in the augmented model: what it moves, and how far that is known."""

from dataclasses import dataclass, field
from typing import Any

from estimator.diagnosis.tables import Law
from estimator.physics.driveline import Structure
from estimator.physics.model import DrivelineModel, Parameter
from estimator.physics.tables import Table

LINE = {"J_M": Parameter(3.7, ci95=(3.0, 4.5)), "J_L": Parameter(93.0, ci95=(92.7, 93.9))} | {
    name: Parameter(value, 0.2) for name, value in {"k": 7600.0, "c": 20.0, "b_M": 0.1, "b_L": 1.0}.items()
}


@dataclass
class Fitted:
    """What a fit with the law left of the line."""

    line: dict[str, float]

    def values_of(self, effect: str) -> dict[str, float]:
        return {} if effect else self.line


@dataclass
class Found:
    effects: dict[str, Any] = field(
        default_factory=lambda: {"table_motor_speed": Table("motor_speed", (0.0, 1.0), (0.0, 2.0)).effect()}
    )


def test_a_value_that_a_law_moves_out_of_its_interval_widens_it() -> None:
    unused: Any = None
    fitted: Any = Fitted({"J_L": 139.0, "J_M": 3.9, "k": 7700.0})
    found: Any = Found()
    law = Law(unused, found, fitted, unused, unused, "")
    after = law.augmented(DrivelineModel(Structure.TWO_MASS, LINE)).parameters
    assert (after["J_L"].value, after["J_L"].ci95) == (139.0, (92.7, 139.0))
    assert (after["J_M"].value, after["J_M"].ci95) == (3.9, (3.0, 4.5))
    assert (after["k"].value, after["k"].ci95, after["k"].tolerance) == (7700.0, None, 0.2)
