"""The rig: configuration, cycle, experiments, simulated slaves, recordings, reports, command line.

From Python: ``hil.look``, ``hil.read``, ``hil.read_model``, ``hil.Record.from_pandas``, ``hil.identify``,
``hil.diagnose`` and ``hil.compare`` (``hil.api``), imported when they are asked for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from hil.version import __version__

if TYPE_CHECKING:
    from hil.api import Record, compare, diagnose, identify, look, read, read_model

__all__ = ["Record", "__version__", "compare", "diagnose", "identify", "look", "read", "read_model"]


def __getattr__(name: str) -> Any:
    if name in __all__:
        from hil import api

        return getattr(api, name)
    raise AttributeError(f"module 'hil' has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__
