"""Checks one EDS against CiA 306 and against what this program needs: every finding with its line.

One rule file per subject; `check` puts them together. A rule reads the file and changes nothing. What concerns
only objects this program does not use is never worse than a warning. What may come in: every
room of drivers.
"""

from drivers.eds_check.check import EdsReport, check_eds

__all__ = ["EdsReport", "check_eds"]
