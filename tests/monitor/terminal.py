"""A real terminal for tests: a pseudo-terminal with a program in it, its screen kept by pyte."""

import fcntl
import os
import pty
import select
import signal
import struct
import sys
import termios
import time
from types import TracebackType
from typing import Self

import pyte

LEAVE_SCREEN = b"\x1b[?1049l"
"""What brings the terminal's own screen back (xterm control sequences, DECRST 1049)."""

PATIENCE_S = 90.0


class Terminal:
    """``hil`` in a pseudo-terminal, from `__enter__` to `__exit__`; what still runs then is killed."""

    def __init__(self, *arguments: str, columns: int = 80, rows: int = 24, no_color: bool = False) -> None:
        self._command = [sys.executable, "-m", "hil", *arguments]
        self._screen = pyte.Screen(columns, rows)
        self._stream = pyte.ByteStream(self._screen)
        given = {name: value for name, value in os.environ.items() if name not in ("COLUMNS", "LINES")}
        self._environment = {**given, "TERM": "xterm-256color", **({"NO_COLOR": "1"} if no_color else {})}
        self.output = bytearray()
        self._closed = False
        self._gone = False

    def __enter__(self) -> Self:
        self._master, self._slave = pty.openpty()
        self.resize(self._screen.columns, self._screen.lines)
        self.settings_before = termios.tcgetattr(self._slave)
        self.pid = os.fork()
        if self.pid == 0:
            os.login_tty(self._slave) if hasattr(os, "login_tty") else _login_tty(self._slave)
            os.execve(sys.executable, self._command, self._environment)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if not self._closed:
            os.kill(self.pid, signal.SIGKILL)
            os.waitpid(self.pid, 0)
        os.close(self._slave)
        if not self._gone:
            os.close(self._master)

    def hang_up(self) -> None:
        """Close the terminal, as the end of an ssh connection does."""
        os.close(self._master)
        self._gone = True

    @property
    def text(self) -> str:
        """What the screen shows."""
        return "\n".join(line.rstrip() for line in self._screen.display)

    @property
    def settings(self) -> list[object]:
        """The terminal's settings now: echo, line mode and all."""
        return termios.tcgetattr(self._slave)

    def resize(self, columns: int, rows: int) -> None:
        """Give the terminal another size, as a window manager does; its program is informed by SIGWINCH."""
        self._screen.resize(rows, columns)
        fcntl.ioctl(self._master, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))

    def press(self, keys: str) -> None:
        """Type."""
        os.write(self._master, keys.encode())

    def signal(self, number: signal.Signals) -> None:
        """Send the program a signal."""
        os.kill(self.pid, number)

    def await_text(self, *words: str) -> str:
        """Read until the screen shows all the words, in a box over two lines too; give what it shows."""
        until = time.monotonic() + PATIENCE_S
        while not all(word in self.text or word in " ".join(self.text.replace("|", " ").split()) for word in words):
            assert time.monotonic() < until, f"no {words} on the screen:\n{self.text}"
            assert self._read(), f"the program ended without {words}:\n{self.text}"
        return self.text

    def await_end(self) -> int:
        """Read until the program has ended; give its exit status."""
        until = time.monotonic() + PATIENCE_S
        while True:
            self._read()
            pid, status = os.waitpid(self.pid, os.WNOHANG)
            if pid:
                self._closed = True
                while self._read():
                    pass
                return os.waitstatus_to_exitcode(status)
            assert time.monotonic() < until, f"the program continues:\n{self.text}"

    def _read(self) -> bool:
        """Take what came within a moment; False where the program has closed its end, or said nothing at its end."""
        if self._gone:
            time.sleep(0.05)
            return not self._closed
        ready, _, _ = select.select([self._master], [], [], 0.05)
        if not ready:
            return not self._closed
        try:
            data = os.read(self._master, 65536)
        except OSError:  # Linux's way to say that the other end is closed
            return False
        self.output += data
        self._stream.feed(data)
        return bool(data)


def _login_tty(slave: int) -> None:
    """Make the terminal this process's own (login_tty(3); in os from Python 3.12 on)."""
    os.setsid()
    fcntl.ioctl(slave, termios.TIOCSCTTY, 0)
    for number in (0, 1, 2):
        os.dup2(slave, number)
