"""What a user of the rig can get wrong, and the exit status each family ends in.

::

    HilError
     +-- InputError           unreadable or wrong input: exit status 2
     |    +-- RigFileError
     |    +-- ModelFileError
     |    +-- RecordingError
     |    +-- StoreError
     |    +-- UsageError
     +-- RunAborted           a run was ended by the rig's state: exit status 3

Each message names the file, the line or key, what was expected, what came, and what to do.
"""

from __future__ import annotations

from pathlib import Path


class HilError(Exception):
    """Base of every error of this package; never raised itself."""


class InputError(HilError):
    """An input file or argument can't be used; nothing was written."""


class UsageError(InputError):
    """A command was given arguments that make no sense together."""


class FileProblem(InputError):
    """One or more faults in a file, each with its place."""

    def __init__(self, path: Path | str, *problems: str) -> None:
        self.path = Path(path)
        self.problems = problems
        super().__init__("\n".join(f"{path}: {problem}" for problem in problems))


class RigFileError(FileProblem):
    """The rig file is wrong."""


class ModelFileError(FileProblem):
    """The model file is wrong."""


class RecordingError(FileProblem):
    """The recording is wrong."""


class StoreError(FileProblem):
    """The store of runs can't be read or written."""


class RunAborted(HilError):
    """A run ended early because the rig was no longer fit for it (clutch, permissive, drive mode, speed).

    The drives are at zero torque and disarmed, and the recording holds everything up to there.
    """
