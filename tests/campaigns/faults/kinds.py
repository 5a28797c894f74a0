"""What goes wrong in the campaign, and what the run is to say then.

A kind is a fault of the simulated devices, as ``hil sim --fault`` takes it, or something the host meets: it is stopped,
stalls, its disk is full, or somebody else sends on its bus.
"""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Kind:
    """One fault."""

    spec: str
    cause: str
    host: str = ""
    needs_torque: bool = False
    may_pass: bool = False
    exceeds: bool = False
    silent: int = 0


_NOT_CONFIRMED = r"not every drive is confirmed disarmed.*inverter m{}"
_STALE = r"stands still|torque actual value|speed is -?\d{1,2}\.\d and -?3\d\d\.\d rad/s"
"""Old feedback shows in its torque, or in a speed that is not the one the other drive reads."""

_STRANGER = "came from somebody else on the bus"

KINDS: dict[str, Kind] = {
    "drive hangs": Kind("m1.hang@S", _NOT_CONFIRMED.format(1), silent=1),
    "drive starts anew": Kind("m2.reset@S", r"inverter m2.*NMT state is"),
    "drive off the bus": Kind("m2.bus_off@S", _NOT_CONFIRMED.format(2), silent=2),
    "drive sends old feedback": Kind("m1.stale_pdo@S", _STALE, needs_torque=True),
    "drive ignores its target": Kind("m2.ignores_target@S", "ignores the target torque"),
    "drive gives double": Kind("m1.torque_gain@S=2", "torque actual value", needs_torque=True, exceeds=True),
    "drive gives nothing": Kind("m2.torque_gain@S=0", "torque actual value", needs_torque=True),
    "drive gives an offset": Kind("m1.torque_offset@S=150", "torque actual value", exceeds=True),
    "drive turns the torque round": Kind("m2.torque_gain@S=-1", "torque actual value", needs_torque=True),
    "drive in fault": Kind("m1.fault@S", "inverter m1.*EMCY 0x2310"),
    "drive tells an emergency": Kind("m2.emcy@S=0x4210", "inverter m2.*EMCY 0x4210"),
    "drive without supply": Kind("m1.brown_out@S", "inverter m1.*EMCY 0x3220"),
    "TPDO too short": Kind("bus.corrupt@S=1:0x181", "inverter m1.*frame of 7 bytes"),
    "RPDO too short": Kind("bus.corrupt@S=1:0x202", "inverter m2.*EMCY 0x8210"),
    "TPDOs lost": Kind("bus.lose@S=1:0x182", "inverter m2: no TPDO"),
    "RPDOs lost": Kind("bus.lose@S=1:0x201", "inverter m1.*EMCY 0x8250|see that its RPDO arrives"),
    "one frame in ten lost": Kind("bus.lose@S=0.1", "inverter m|TPDO", may_pass=True),
    "frames doubled": Kind("bus.repeat@S=0.3", "inverter m", may_pass=True),
    "host bus-off": Kind("bus.off@S", "bus-off", silent=3),
    "clutch closes": Kind("plc.clutch_closes@S", "clutch is closed"),
    "permissive withdrawn": Kind("plc.permissive_withdrawn@S", "permissive is withdrawn"),
    "drive mode changes": Kind("plc.mode_changes@S", "drive mode is electric"),
    "PLC hangs": Kind("plc.hang@S", "PLC"),
    "PLC answers with exceptions": Kind("plc.exception@S", "PLC.*exception"),
    "PLC is slow": Kind("plc.slow@S", "PLC"),
    "PLC gives half an answer": Kind("plc.half_answer@S", "PLC"),
    "PLC resets the connection": Kind("plc.reset@S", "PLC"),
    "PLC answers for another unit": Kind("plc.wrong_unit@S", "PLC"),
    "PLC gives too few registers": Kind("plc.wrong_width@S", "PLC"),
    "host stopped (Ctrl-C)": Kind("", "KeyboardInterrupt", host="stop"),
    "host stalls for 2 s": Kind("", "This machine was too busy", host="stall"),
    "disk full": Kind("", "expected room for sample", host="disk"),
    "foreign RPDO": Kind("", _STRANGER, host="201:0f00e8030000"),
    "foreign SYNC": Kind("", _STRANGER, host="080:"),
    "foreign NMT stop": Kind("", _STRANGER, host="000:0202"),
    "foreign NMT reset": Kind("", _STRANGER, host="000:8101"),
    "foreign heartbeat of the host": Kind("", _STRANGER, host="77f:05"),
    "foreign SDO request": Kind("", _STRANGER, host="602:4041600000000000"),
}

UNTOUCHED = Kind("", "", may_pass=True)
"""Nothing goes wrong."""
