"""For Python and notebooks: what the commands do, as functions, with results that show and save themselves.

What may come in: everything but the command line.
"""

from hil.api.comparison import ComparisonResult, compare
from hil.api.diagnosis import DiagnosisResult, diagnose
from hil.api.identification import IdentificationResult, identify
from hil.api.models import read_model
from hil.api.record import LookResult, Record, look, read

__all__ = [
    "ComparisonResult",
    "DiagnosisResult",
    "IdentificationResult",
    "LookResult",
    "Record",
    "compare",
    "diagnose",
    "identify",
    "look",
    "read",
    "read_model",
]
