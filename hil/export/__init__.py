"""The on-line estimator for a PLC, and the driveline for other simulations.

What lives here: the estimator as Structured Text and PLCopen XML, the driveline as an FMU. What may come in: models,
effects, states of estimators; no rig.
"""

from enum import Enum


class FmiVersion(Enum):
    """Versions of the Functional Mock-up Interface that are written."""

    V2 = "2.0"
    V3 = "3.0"


class Tc6(Enum):
    """Versions of the format. What is written here is the same in both but for the namespace."""

    V2_01 = "2.01"
    V2_0 = "2.0"

    @property
    def namespace(self) -> str:
        """URI of its XML namespace."""
        return {Tc6.V2_01: "http://www.plcopen.org/xml/tc6_0201", Tc6.V2_0: "http://www.plcopen.org/xml/tc6_0200"}[self]
