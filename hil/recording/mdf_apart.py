"""Read an MDF file in a process of its own: one that is damaged may end that process, and not this one.

``python -m hil.recording.mdf_apart FILE`` writes the table, or what is wrong with the file, to standard output.
"""

from __future__ import annotations

import pickle
import subprocess
import sys
from pathlib import Path

from hil.errors import RecordingError
from hil.recording.mdf_file import opened
from hil.recording.mdf_parse import parse
from hil.recording.table import Table

START_S = 60.0
BYTES_PER_S = 2e5
"""The longest a whole file is given: a twentieth of the 4 MB/s measured on a busy machine."""


def read_apart(path: Path) -> Table:
    """Read a file in a process of its own.

    Raises
    ------
    RecordingError
        If it is damaged, also where that ends the process, or it does not come to an end.
    """
    limit_s = START_S + path.stat().st_size / BYTES_PER_S
    try:
        # The process is this program's, and so is what it answers: there is nothing foreign to unpickle.
        done = subprocess.run(
            [sys.executable, "-m", __spec__.name, str(path)], capture_output=True, timeout=limit_s, check=False
        )
    except subprocess.TimeoutExpired as error:
        raise RecordingError(
            path, f"expected an MDF file that is read within {limit_s:.0f} s, came one that is not: it is damaged."
        ) from error
    if done.returncode != 0:
        raise RecordingError(
            path, f"expected a whole MDF file, came a damaged one (its reader ended with {done.returncode})"
        )
    answer: Table | tuple[str, ...] = pickle.loads(done.stdout)
    if isinstance(answer, tuple):
        raise RecordingError(path, *answer)
    return answer


def _answer(path: Path) -> Table | tuple[str, ...]:
    try:
        with opened(path) as mdf:
            return parse(path, mdf)
    except RecordingError as error:
        return error.problems


if __name__ == "__main__":
    sys.stdout.buffer.write(pickle.dumps(_answer(Path(sys.argv[1]))))
