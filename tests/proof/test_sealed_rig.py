"""The sealed rig as a process: real sockets, real protocol stacks, the truth only when asked."""

import signal
import subprocess
import sys
from dataclasses import dataclass

import pytest

from drivers.errors import BusDown
from drivers.plc.types import DriveMode
from hil.config.model_file import read_model
from hil.config.rig_file import read_rig
from hil.errors import RunAborted
from hil.proof.rigs import sealed_process
from hil.proof.seal import verify
from hil.proof.sealed_rig import RIG_FILE
from hil.rig.build import open_devices
from hil.rig.pacing import FreePacer, device_patience_s, period_ns
from hil.rig.plan import plan_run
from hil.rig.session import run_plan
from hil.rig.stop import StopRequest
from hil.simulator.addresses import with_addresses
from tests.chosen import campaign


@dataclass
class _List:
    """A recorder that keeps its samples."""

    samples: list

    def append(self, sample):
        self.samples.append(sample)


def _rig_at(sealed):
    """The rig file with the addresses the sealed rig is really served at."""
    return with_addresses(read_rig(RIG_FILE), sealed.bus, sealed.modbus)


def test_the_devices_are_on_the_wire_and_the_truth_comes_when_asked(tmp_path):
    nominal = tmp_path / "nominal.toml"
    with sealed_process("--seed", "5", "--model", str(nominal)) as sealed:
        with open_devices(_rig_at(sealed)) as devices:
            for inverter in (devices.m1, devices.m2):
                inverter.configure()
            status = devices.plc_loop.call(devices.plc.read_status())
        assert status.drive_mode is DriveMode.SERIES
        truth = verify(sealed.commitment, sealed.open())
    assert truth["seed"] == 5
    assert {name: entry.value for name, entry in read_model(nominal).model.parameters.items()} == pytest.approx(
        truth["nominal"], rel=1e-5
    )
    with pytest.raises(BusDown), open_devices(_rig_at(sealed)):
        pass


@pytest.mark.campaign
def test_torque_moves_the_hidden_driveline():
    with sealed_process("--seed", "5", "--effect", "backlash") as sealed:
        rig = _rig_at(sealed)
        short = rig.experiments["reversal"].model_copy(update={"duration_s": 2.0})
        rig = rig.model_copy(update={"experiments": {"short": short}})
        samples = []
        pacer = FreePacer(period_ns(rig.period_s))
        with open_devices(rig, device_patience_s(pacer)) as devices:
            run_plan(devices, plan_run(rig, "short"), pacer, _List(samples), StopRequest(), lambda *_: None)
    assert len(samples) == 200
    assert max(sample.speed_rad_s for sample in samples) > 2.0
    assert all(sample.flags == 0 for sample in samples)


@pytest.mark.campaign
def test_a_rig_that_has_gone_is_named():
    with sealed_process("--seed", "5") as sealed:
        sealed._process.send_signal(signal.SIGTERM)
        sealed._process.wait()
        with pytest.raises(RunAborted, match="expected an answer, but it ended with status 0; it said: nothing"):
            sealed.open()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--seed", "5", "--effect", "rust"), "status 2; it said: error: effect 'rust': expected one of none"),
        campaign(
            (("--seed", "5", "--bus", "ws://192.0.2.1:0/"), "status 2; it said: error: address 'ws://192.0.2.1:0/'")
        ),
    ],
)
def test_a_rig_that_does_not_come_up_says_why(arguments, said):
    with pytest.raises(RunAborted, match=said), sealed_process(*arguments):
        pass


@pytest.mark.campaign
@pytest.mark.parametrize("end", [signal.SIGINT, signal.SIGTERM, None])
def test_it_ends_cleanly_by_signal_and_by_the_end_of_its_input(end):
    process = subprocess.Popen(
        [sys.executable, "-m", "hil.proof.sealed_rig", "--seed", "1"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout.readline().startswith("ready ")
    if end is not None:
        process.send_signal(end)
    out, err = process.communicate("close\n" if end is None else None, timeout=30)
    assert process.returncode == 0
    assert err == ""
    if end is None:
        assert "expected the line 'open' or the end of input, got 'close'" in out
    assert "truth" not in out
