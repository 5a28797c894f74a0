"""Drives armed for the time of a block; at zero torque and disarmed after it, both, whatever happens."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from types import TracebackType
from typing import Self

from drivers.errors import CommandRefused, DeviceFault
from drivers.inverter.inverter import Inverter
from hil.errors import RunAborted
from hil.rig.build import Devices
from hil.rig.stop import StopRequest


class ArmedDrives:
    """Context manager: arm both drives, disarm both."""

    __slots__ = ("_devices", "_stop")

    def __init__(self, devices: Devices, stop: StopRequest) -> None:
        self._devices = devices
        self._stop = stop

    def __enter__(self) -> Self:
        self._devices.link.watch_strangers(self._devices.m1.settings.host_node_id)
        try:
            for inverter in (self._devices.m1, self._devices.m2):
                self._stop.raise_if_requested()
                inverter.arm()
        except BaseException as error:  # __exit__ is not called when __enter__ fails
            self._disarm_all(error)
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._disarm_all(error)

    def _disarm_all(self, error: BaseException | None) -> None:
        self._devices.guard.disable()
        self._devices.link.pdos_to_disable.end()
        # A head start only: what counts is that each drive then confirms it is disarmed.
        not_zeroed = _failures(self._zero_both)
        not_disarmed = self._disarm({"m1": self._devices.m1, "m2": self._devices.m2})
        if not_disarmed:
            cause = "" if error is None else f" What ended the run: {error or type(error).__name__}"
            reasons = [f"{' and '.join(names)}: {reason}" for reason, names in not_disarmed.items()]
            reasons += [reason for reason in not_zeroed if reason not in not_disarmed]
            raise RunAborted(
                f"not every drive is confirmed disarmed: {'; '.join(reasons)}. Expected "
                f"both to be; cut the power of the drive named before anyone goes near the shaft.{cause}"
            ) from error

    @staticmethod
    def _disarm(drives: dict[str, Inverter]) -> dict[str, list[str]]:
        """Disarm all; give each reason why one is not confirmed, with the names of those it holds for.

        An answer that is lost or late says nothing of the drive: who has not confirmed is asked once more, after
        the others, which must not wait for it.
        """
        first = {name: _failures(inverter.disarm) for name, inverter in drives.items()}
        names_of: dict[str, list[str]] = {}
        for name in (name for name, reasons in first.items() if reasons):
            for reason in _failures(drives[name].disarm):
                names_of.setdefault(reason, []).append(name)
        return names_of

    def _zero_both(self) -> None:
        """Take both to zero with the next SYNC, so that neither waits for the other's disarming."""
        for inverter, torque in zip((self._devices.m1, self._devices.m2), self._devices.guard.zero(), strict=True):
            with suppress(CommandRefused, DeviceFault):  # not armed yet, or not enabled any more
                inverter.command(torque)
        self._devices.link.sync()


def _failures(step: Callable[[], None]) -> list[str]:
    """Run one step and tell what went wrong, each reason once; nothing may keep the steps after it from being tried."""
    try:
        step()
    except Exception as error:  # noqa: BLE001 - also a defect of ours must not leave the other drive armed
        reasons = [str(error) or type(error).__name__, *getattr(error, "__notes__", ())]
        return list(dict.fromkeys(reason.rstrip(".") for reason in reasons))
    return []
