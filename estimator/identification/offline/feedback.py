"""Whether the torque followed the speed while it was recorded, and what that does to each estimate.

A driver, a cruise controller or an anti-jerk function that answers the speed carries noise from the output back into
the input (L. Ljung, System Identification, 2nd ed., section 13.4). It shows as a correlation of the residual with
input too late to have caused it: see :mod:`estimator.identification.offline.validation`. Judge at the recording's own
period: decimated signals were low-passed, and their present output goes with a little of the input to come.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from estimator.identification.offline.validation import Validation

SIGNIFICANCE = 0.01
"""False alarms of the detection, on recordings in open loop."""

CONSEQUENCES = MappingProxyType(
    {
        "output_error": "biased towards minus the inverse of the feedback where the noise is stronger than the PRBS",
        "box_jenkins": "unbiased as long as its noise model is right and the loop holds at least one sample of delay",
        "spectral": "a mean of B / A and minus the inverse of the feedback, weighted by PRBS and noise",
        "recursive": "as output_error",
    }
)
"""What feedback does to each estimate, by the name of its method."""


@dataclass(frozen=True, slots=True)
class Feedback:
    """Whether there was feedback and what it means.

    Attributes
    ----------
    detected : bool
    p_value : float
        Probability of a correlation with later input at least this large without feedback.
    consequences : Mapping[str, str]
        By method; empty if none was detected.
    statement : str
    """

    detected: bool
    p_value: float
    consequences: Mapping[str, str]
    statement: str


def judge_feedback(validation: Validation) -> Feedback:
    """Tell from a validated fit whether its recording was made in closed loop.

    Parameters
    ----------
    validation : Validation
        Of any fit of a useful order; a poor model only makes the test less sharp.
    """
    p_value = validation.feedback.p_value
    if p_value > SIGNIFICANCE:
        statement = f"No sign of the torque following the speed (p = {p_value:.2g})."
        return Feedback(False, p_value, MappingProxyType({}), statement)
    statement = (
        f"The torque follows the speed (p = {p_value:.2g}): a driver or controller closes the loop. The output-error, "
        "recursive and spectral estimates are biased by the noise it feeds back. Use the Box-Jenkins model, or "
        "hold the torque except for the PRBS."
    )
    return Feedback(True, p_value, CONSEQUENCES, statement)
