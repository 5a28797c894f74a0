"""Values of a model that are possible but hardly meant: reported before anything is fitted with them."""

from __future__ import annotations

import math
from collections.abc import Mapping

from estimator.physics.model import DrivelineModel, Structure, natural_frequencies_rad_s

UNEQUAL = 1000.0
"""Ratio of two inertias from which on one of them is invisible from the other: 1 / 1000 of the motion."""


def model_warnings(model: DrivelineModel) -> list[str]:
    """Return what is odd about a model's values, one sentence each; values that can't be are refused by the model."""
    values = model.values()
    damping = _damping(values) if model.structure is Structure.TWO_MASS else []
    return [*_inertias({name: value for name, value in values.items() if name.startswith("J")}), *damping]


def _inertias(values: Mapping[str, float]) -> list[str]:
    small, large = min(values, key=values.__getitem__, default=""), max(values, key=values.__getitem__, default="")
    if small == large or values[large] < UNEQUAL * values[small]:
        return []
    return [
        f"model: {small} = {values[small]:g} and {large} = {values[large]:g} differ by a factor of "
        f"{values[large] / values[small]:.3g}; the smaller one can hardly be seen. Are both reflected to the motor "
        "shaft and in the same unit?"
    ]


def _damping(values: Mapping[str, float]) -> list[str]:
    first = float(natural_frequencies_rad_s(values)[0])
    ratio = 0.5 * values["c"] * first / values["k"]  # of the relative motion of two masses: 2 zeta w_0 = c w_0^2 / k
    if ratio < 1.0:
        return []
    return [
        f"model: with c = {values['c']:g} and k = {values['k']:g} the first mode ({first / (2.0 * math.pi):.3g} Hz) is "
        f"damped {ratio:.3g} times critically: the line does not oscillate. Are k and c in the right unit and order?"
    ]
