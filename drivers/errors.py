"""What can go wrong between this program and a device, by who is at fault.

::

    DriverError
     +-- CommandRefused    (ValueError)       our mistake: the torque guard said no
     +-- ConfigMismatch                       rig file, EDS and device disagree
     +-- DeviceFault                          the device reports FAULT or EMCY
     |    +-- WrongTorque                     its torque is not the one commanded
     +-- ForeignController                    somebody else commands the devices
     +-- ProtocolViolation                    the device broke CiA 301, CiA 402 or Modbus
     +-- DeviceTimeout     (TimeoutError)     no answer in time
     +-- BusDown           (ConnectionError)  the bus itself is not there

Every message says what was expected, what came, where, and what to do next.
"""

from __future__ import annotations


class DriverError(Exception):
    """Base of every error of this package; never raised itself."""


class CommandRefused(DriverError, ValueError):
    """The torque guard refused a command: the caller is at fault.

    Examples: a torque above the limit, a step faster than the allowed rate, feedback that is too old.
    To do: lower the request or fix the source of the stale feedback; the drive is at zero torque.
    """


class ConfigMismatch(DriverError):
    """Rig file, EDS and device disagree: whoever configured the rig is at fault.

    Examples: another identity in object 0x1018, another rated torque in 0x6076, a PDO map that differs.
    To do: compare the three; never run a drive whose scales are not the ones in the rig file.
    """


class DeviceFault(DriverError):
    """The device reports a fault (CiA 402 FAULT state, EMCY, PLC permissive withdrawn).

    To do: read the cause in the message at the device, fix it, reset the fault, start again.
    """


class WrongTorque(DeviceFault):
    """The torque actual value is not the torque commanded.

    Examples: a drive set to another rated torque, a sign turned round, a torque that somebody else adds.
    To do: compare the drive's scale, sign and limits with the rig file; look for another controller.
    """


class ForeignController(DriverError):
    """Somebody else commands the devices of this program.

    Examples: another master's SYNC or NMT command, an RPDO this program has not sent.
    To do: end the other program, or unplug the other controller; two can't drive one shaft.
    """


class ProtocolViolation(DriverError):
    """The device answered something its protocol does not allow.

    Examples: a PDO of the wrong length, a Modbus answer with another register count.
    To do: check firmware version and EDS or register map.
    """


class DeviceTimeout(DriverError, TimeoutError):
    """A device that should answer did not, in the time it was given.

    Examples: node not powered, wrong node id, cable, PLC program stopped.
    To do: check power, node id and wiring named in the message.
    """


class BusDown(DriverError, ConnectionError):
    """The bus itself can't be opened or has gone: no device can be reached.

    Examples: CAN interface missing, bus-off, no server at the TCP address.
    To do: check the bus URL of the rig file and the adapter.
    """
