"""A run on the simulated rig with its bus traced."""

from pathlib import Path

import pytest

from drivers.errors import DeviceFault
from hil.config.rig_file import Rig
from hil.rig.build import open_devices
from hil.rig.trace import BusTrace
from hil.simulator.faults import AtStep, InverterFaults, RigFaults
from tests.rig.serving import Samples, run, served

EXCESS_TEMPERATURE = 0x4310
FAULT_AT_STEP = 150


def traced_run(path: Path, rig: Rig | None = None, faults: RigFaults | None = None) -> Samples:
    """Run a reversal on the small rig; the bus goes to a trace, the samples come back."""
    samples = Samples()
    with served(rig, faults) as (_, at), open_devices(at) as devices, BusTrace(path) as trace:
        devices.link.trace_by(trace.take)
        try:
            run(at, devices, samples, experiment="reversal")
        finally:
            devices.link.trace_by(None)
    return samples


def traced_fault(path: Path) -> None:
    """A run that an inverter's fault ends: every kind of message the host and the drives know is on the bus."""
    faults = RigFaults(m1=InverterFaults(fault=AtStep(FAULT_AT_STEP, EXCESS_TEMPERATURE)))
    with pytest.raises(DeviceFault):
        traced_run(path, faults=faults)
