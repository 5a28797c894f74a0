"""Effects with one size, and how a size is imposed on a specimen instead of the one that was drawn."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

from hil.errors import UsageError
from hil.proof.truth.hidden import Scale
from hil.proof.truth.registry import EFFECTS
from hil.proof.truth.specimen import Specimen

SCALES: Mapping[str, Scale] = {name: effect.scale for name, effect in EFFECTS.items() if effect.scale is not None}
"""How the effects with one size are made greater and smaller, by their names."""


def imposed(specimen: Specimen, size: float) -> Specimen:
    """Return a specimen with the one effect it hides at a size, on the side of its absence that was drawn; 0 is absent.

    Raises
    ------
    UsageError
        If the specimen's effect has no single size.
    """
    scale = scale_of(specimen.effect)
    drawn = specimen.sizes[specimen.effect]
    (key,) = drawn
    value = scale.absent + math.copysign(size, drawn[key] - scale.absent)
    return replace(specimen, sizes={specimen.effect: {key: value}})


def scale_of(effect: str) -> Scale:
    """Return what the size of an effect is.

    Raises
    ------
    UsageError
        If it has no single size.
    """
    if effect not in SCALES:
        raise UsageError(f"effect {effect!r}: expected one with a single size ({', '.join(SCALES)}).")
    return SCALES[effect]
