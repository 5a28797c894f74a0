"""Where the project's data files are: EDS and register map.

An installed wheel carries them in ``drivers/eds``; a checkout keeps them in ``eds`` next to the packages,
where a bus engineer looks for them.
"""

from __future__ import annotations

from pathlib import Path

from drivers.errors import ConfigMismatch

_PACKAGE = Path(__file__).resolve().parent
_FOLDERS = (_PACKAGE / "eds", _PACKAGE.parent / "eds")


def data_file(name: str) -> Path:
    """Locate a shipped data file by name, for example ``inverter.eds``."""
    for folder in _FOLDERS:
        if (folder / name).is_file():
            return folder / name
    raise ConfigMismatch(
        f"data file {name}: expected in {' or '.join(map(str, _FOLDERS))}, found in neither. "
        "Install the package again, or give the file's path in the rig file."
    )
