"""From what is published to the recording that is read.

The friction damper's files hold ``{"data": [[time s, displacement in, friction force kip, velocity in/s, ...], ...]}``.
The recording is CSV in SI units, written with as many digits as the sensors have.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

from hil.proof.real.case_file import Conversion

M_PER_INCH = 0.0254
N_PER_KIP = 4448.2216152605
"""1000 pounds of 0.45359237 kg under 9.80665 m/s^2."""

HEADER = "time_s,displacement_m,velocity_m_s,force_n"


class NotAsPublished(Exception):
    """What was downloaded is not in the form that its publishers describe."""


def friction_damper(content: bytes) -> bytes:
    """Return the CSV of one of the friction damper's JSON files.

    Raises
    ------
    NotAsPublished
        If the file is not of that form.
    """
    try:
        rows = json.loads(content)["data"]
        lines = [
            f"{row[0]:.7f},{row[1] * M_PER_INCH:.7g},{row[3] * M_PER_INCH:.6g},{row[2] * N_PER_KIP:.6g}" for row in rows
        ]
    except (ValueError, KeyError, TypeError, IndexError) as error:
        raise NotAsPublished(
            f'expected JSON with "data", rows of time, displacement, force, velocity, got {content[:40]!r} ({error})'
        ) from error
    return ("\n".join([HEADER, *lines]) + "\n").encode("ascii")


def unchanged(content: bytes) -> bytes:
    """Return what was downloaded."""
    return content


CONVERSIONS: Mapping[Conversion, Callable[[bytes], bytes]] = MappingProxyType(
    {Conversion.NONE: unchanged, Conversion.FRICTION_DAMPER: friction_damper}
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Convert a file that was downloaded by hand; return the exit status."""
    parser = argparse.ArgumentParser(
        prog="python -m hil.proof.real.convert", description="Turn a published file into the recording that is read."
    )
    parser.add_argument("conversion", choices=[conversion.value for conversion in Conversion])
    parser.add_argument("published", type=Path)
    parser.add_argument("recording", type=Path)
    options = parser.parse_args(arguments)
    try:
        content = CONVERSIONS[Conversion(options.conversion)](options.published.read_bytes())
        options.recording.parent.mkdir(parents=True, exist_ok=True)
        options.recording.write_bytes(content)
    except (NotAsPublished, OSError) as error:
        parser.error(str(error))
    return 0


if __name__ == "__main__":
    sys.exit(main())
