"""What every test starts from."""

import gc
import os
import signal


def pytest_configure() -> None:
    """Let a hang-up end what tests start, and keep no log of it in the home of who tests.

    Under nohup a hang-up is ignored, and children inherit that.
    """
    signal.signal(signal.SIGHUP, signal.SIG_DFL)
    os.environ["HIL_LOG"] = "off"
    gc.disable()


def pytest_collection_finish() -> None:
    """Let the garbage collector work again.

    Of ten thousand tests that are being collected none is garbage; to look through them again and again takes half as
    long as the collection itself.
    """
    gc.enable()
