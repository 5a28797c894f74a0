"""The sealed rig as seen by whoever drives it: started, asked to open its seal, ended."""

from __future__ import annotations

import json
import re
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import IO, cast

from hil.child import environment, python
from hil.errors import RunAborted
from hil.proof.wire.sealed_rig import OPEN

_READY = re.compile(r"ready bus=(?P<bus>\S+) modbus=(?P<modbus>\S+) commitment=(?P<commitment>[0-9a-f]{64})\n")

_END_S = 5.0
"""Time the process gets to end by itself once its input has ended [s]."""


@dataclass(frozen=True, slots=True)
class SealedProcess:
    """A sealed rig that is up.

    Attributes
    ----------
    bus, modbus, commitment : str
        As in its ready line.
    """

    bus: str
    modbus: str
    commitment: str
    _pipes: _Pipes

    def open(self) -> object:
        """Have the seal opened; return it as read from JSON, to be verified against the commitment.

        Raises
        ------
        RunAborted
            If the rig is no longer there.
        """
        return json.loads(self._pipes.ask(OPEN))


@dataclass(frozen=True, slots=True)
class _Pipes:
    """The process with its three standard streams."""

    process: subprocess.Popen[str]
    asked: IO[str]
    answers: IO[str]
    complaints: IO[bytes]

    def ask(self, line: str) -> str:
        try:
            self.asked.write(f"{line}\n")
            self.asked.flush()
        except BrokenPipeError as error:
            raise self._gone() from error
        return self.answer()

    def answer(self) -> str:
        line = self.answers.readline()
        if not line:
            raise self._gone()
        return line

    def end(self) -> None:
        """End the process: by the end of its input, or by force if that is not heard."""
        with suppress(BrokenPipeError):  # what was still to be written to a process that is gone
            self.asked.close()
        try:
            self.process.wait(_END_S)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        self.answers.close()

    def _gone(self) -> RunAborted:
        status = self.process.wait()
        self.complaints.seek(0)
        said = self.complaints.read().decode(errors="replace").strip() or "nothing"
        return RunAborted(f"sealed rig: expected an answer, but it ended with status {status}; it said: {said}")


@contextmanager
def sealed_process(*arguments: str) -> Iterator[SealedProcess]:
    """Serve a sealed rig in a process of its own, for the time of the block.

    It is in a session of its own: Ctrl-C at the terminal must reach the drives' master first, which then
    still has a rig to disarm. If this process dies, the end of its input ends the rig too.

    Parameters
    ----------
    *arguments
        Those of ``python -m hil.proof.wire.sealed_rig``.

    Raises
    ------
    RunAborted
        If the rig does not come up; with what it said.
    """
    with tempfile.TemporaryFile() as complaints, tempfile.TemporaryDirectory(prefix="hil-sealed-") as folder:
        pipes = _start(arguments, complaints, folder)
        try:
            yield _meet(pipes)
        finally:
            pipes.end()


def _start(arguments: tuple[str, ...], complaints: IO[bytes], folder: str) -> _Pipes:
    process = subprocess.Popen(
        python("-m", "hil.proof.wire.sealed_rig", *arguments),
        cwd=folder,
        env=environment(),
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=complaints,
        text=True,
        start_new_session=True,
    )
    asked, answers = cast(IO[str], process.stdin), cast(IO[str], process.stdout)  # both are pipes, see above
    return _Pipes(process, asked, answers, complaints)


def _meet(pipes: _Pipes) -> SealedProcess:
    line = pipes.answer()
    ready = _READY.fullmatch(line)
    if ready is None:
        raise RunAborted(f"sealed rig: expected 'ready bus=... modbus=... commitment=...', got {line!r}")
    return SealedProcess(ready["bus"], ready["modbus"], ready["commitment"], pipes)
