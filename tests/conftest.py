"""What every test starts from."""

from __future__ import annotations

import os
import signal


def pytest_configure() -> None:
    """Let a hang-up end what tests start, and keep no log of it in the home of who tests.

    Under nohup a hang-up is ignored, and children inherit that.
    """
    signal.signal(signal.SIGHUP, signal.SIG_DFL)
    os.environ["HIL_LOG"] = "off"
