"""A virtual bus of this process that hands a frame to its receiver in the thread that sends it.

python-can's own virtual bus has a queue per participant, and a thread at the end of each: two changes of thread
for one SYNC and its answer, which take longer than everything the frames are sent for. Here the queue is kept,
so that every other participant of the channel, python-can's own included, sends and receives as ever; only the
waiting thread is gone. A participant gets its frames one at a time and in their order. A thread that sends while
another one is handing over there waits for its turn; but a frame sent in answer to a frame, from inside a receiver,
is left to that other thread: waiting there, two threads could wait for each other.
"""

from __future__ import annotations

import queue
import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Any

import can
from can.interfaces.virtual import VirtualBus, channels_lock

Receiver = Callable[[can.Message], None]  # takes one frame; it raises nothing


TURN_S = 1e-3
"""After which a thread that waits for its turn looks whether its frame has been taken meanwhile: the lock goes to
whoever is quickest, and a heartbeat's thread may never be."""


class _Thread(threading.local):
    """Whether the present thread is inside a receiver, of whatever inbox."""

    receives = False


_THIS_THREAD = _Thread()


class _Inbox(queue.Queue[can.Message]):
    """One participant's queue, emptied by whoever fills it."""

    def __init__(self) -> None:
        super().__init__()
        self._frames: deque[can.Message] = deque()
        self._taking = threading.Lock()
        self._receiver: Receiver | None = None

    def put(self, item: can.Message, block: bool = True, timeout: float | None = None) -> None:
        self._frames.append(item)
        if self._receiver is not None:
            self._hand_over(self._receiver)

    def open(self, receiver: Receiver) -> None:
        self._receiver = receiver
        self._hand_over(receiver)

    def close(self) -> None:
        """Take no more; what another thread is taking is waited for."""
        self._receiver = None
        self._frames.clear()
        with self._taking:
            self._frames.clear()

    def _hand_over(self, receiver: Receiver) -> None:
        frames, answering = self._frames, _THIS_THREAD.receives
        while frames and self._receiver is not None:
            if not self._taking.acquire(timeout=0.0 if answering else TURN_S):
                if answering:
                    return  # whoever holds it looks for more once it is released
                continue
            _THIS_THREAD.receives = True
            try:
                while frames and self._receiver is not None:
                    receiver(frames.popleft())
            finally:
                _THIS_THREAD.receives = answering
                self._taking.release()


class InlineBus(VirtualBus):
    """One participant of a virtual channel, whose receiver is called in the sender's thread."""

    def __init__(self, channel: str, **options: Any) -> None:
        super().__init__(channel, **options)
        self._inbox = _Inbox()
        with channels_lock:
            self.channel[self.channel.index(self.queue)] = self._inbox
            self.queue = self._inbox

    def receive_by(self, receiver: Receiver) -> None:
        """Have ``receiver`` called for every frame from now on; those that came before come first."""
        self._inbox.open(receiver)

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Put a copy of a frame into the queue of every other participant."""
        self.hand_out(_copied(msg), timeout)

    def hand_out(self, message: can.Message, timeout: float | None = None) -> None:
        """Give a frame away: another participant gets it as it is, any further one a copy."""
        self._check_if_open()
        message.timestamp = time.time()
        message.channel = self.channel_id
        message.is_rx = True
        others = [inbox for inbox in self.channel if inbox is not self.queue]
        own = [message] if len(others) == 1 else [message, *(_copied(message) for _ in others[1:])]
        try:
            for inbox, frame in zip(others, own, strict=False):  # where nobody else is, it goes nowhere
                inbox.put(frame, True, timeout)
        except queue.Full as error:
            raise can.CanOperationError("a participant's queue is full") from error

    def shutdown(self) -> None:
        """Leave the channel; once this returns the receiver is not called any more."""
        self._inbox.close()
        super().shutdown()


def _copied(message: can.Message) -> can.Message:
    copy = message.__copy__()
    copy.data = bytearray(message.data)
    return copy
