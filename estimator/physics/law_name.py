"""The name of a user's own law, which knows the law: it belongs to the model that has it, and to no other.

A name goes wherever the name of a catalogue's entry goes, into unknowns, sets of effects and results. What stands
behind an entry's name is the same in every process (``catalogue.EFFECTS``, ``layout.slot``); what stands behind this
one is its own, so that two models can have laws of the same name.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from estimator.physics.effect import Effect
    from estimator.physics.own_forces import Forces
    from estimator.physics.own_law import OwnLaw
    from estimator.signals.record import FloatArray


class LawName(str):
    """The name of a law of one model; as a text it is like any other.

    Attributes
    ----------
    law : OwnLaw
    entry : Effect
        The law as an entry of the catalogue.
    places : mapping of str to int
        Where each of its parameters stands in the parameter vector of its model, behind those of the catalogue.
    compiled : dict of tuple of LawName to Forces
        It and laws after it of the same model as one function, where that was asked for.
    """

    law: OwnLaw
    entry: Effect
    places: Mapping[str, int]
    compiled: dict[tuple[LawName, ...], Forces]

    def is_active(self, p: FloatArray) -> bool:
        """Tell whether a parameter vector switches the law on."""
        first = self.law.parameters[0]
        return bool(p[self.places[first.name]] != first.null)

    def ordered_places(self) -> list[int]:
        """Return where the parameters stand in the order in which the law's function takes them."""
        return [self.places[name] for name in self.law.taken]

    def values(self, p: FloatArray) -> dict[str, float]:
        """Return the law's parameters from the parameter vector."""
        return {name: float(p[place]) for name, place in self.places.items()}
