"""What every test starts from."""

from __future__ import annotations

import signal


def pytest_configure() -> None:
    """Let a hang-up end what tests start: under nohup it is ignored, and children inherit that."""
    signal.signal(signal.SIGHUP, signal.SIG_DFL)
