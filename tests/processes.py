"""Whether a process is still there, for tests of what a command leaves behind."""

import time
from pathlib import Path

GONE_S = 20.0


def is_gone(process: int, within_s: float = GONE_S) -> bool:
    """Whether a process is gone within some time, or about to be waited for."""
    until_s = time.monotonic() + within_s
    while time.monotonic() < until_s:
        try:
            if ") Z " in Path(f"/proc/{process}/stat").read_text():
                return True
        except OSError:
            return True
        time.sleep(0.02)
    return False
