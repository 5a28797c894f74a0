"""Completion scripts for shells: commands, options, names of experiments and effects, files.

The scripts carry every word in them, so that a Tab costs no start of Python; names of experiments are read out of the
rig file on the line.
"""

from hil.support.completion.scripts import SHELLS, script

__all__ = ["SHELLS", "script"]
