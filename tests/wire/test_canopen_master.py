"""The ``canopen`` library's own CiA 402 master drives the simulated inverter: two programs that share no driver.

The bus and the object dictionary are all they have in common; the state machine of the library is its own.
"""

from collections.abc import Iterator
from contextlib import contextmanager

import canopen
import pytest
from canopen.profiles.p402 import BaseNode402

from drivers.resources import data_file
from hil.simulator.simulated_rig import SimulatedRig
from tests.drivers.can_bench import SIMULATED_M1, SIMULATED_M2, new_channel, virtual_bus
from tests.simulator.rigid_plant import RigidPlant

NODE_ID = SIMULATED_M1.node_id
SYNC_S = 0.005
STEPS = ["READY TO SWITCH ON", "SWITCHED ON", "OPERATION ENABLED"]


@contextmanager
def master() -> Iterator[tuple[SimulatedRig, BaseNode402]]:
    """A network of the library's own, with its own receive thread and its own SYNC producer."""
    channel = new_channel()
    network = canopen.Network()
    with SimulatedRig(virtual_bus(channel), RigidPlant(100.0, 0.5), (SIMULATED_M1, SIMULATED_M2)) as rig:
        network.connect(interface="virtual", channel=channel, ignore_config=True)
        try:
            node = BaseNode402(NODE_ID, str(data_file("inverter.eds")))
            network.add_node(node)
            node.sdo.RESPONSE_TIMEOUT = 2.0
            node.sdo[0x1017].raw = 50
            node.nmt.wait_for_heartbeat(timeout=60.0)
            node.setup_402_state_machine()
            node.nmt.state = "OPERATIONAL"
            node.rpdo[1].start(SYNC_S)  # the library leaves the sending of a synchronous RPDO to its user
            network.sync.start(SYNC_S)
            yield rig, node
        finally:
            network.sync.stop()
            node.rpdo.stop()
            network.disconnect()


def test_it_takes_the_inverter_to_operation_enabled_and_back() -> None:
    with master() as (_, node):
        node.sdo[0x6060].raw = 10
        assert node.op_mode == "CYCLIC SYNCHRONOUS TORQUE"
        assert node.is_op_mode_supported("PROFILED TORQUE")
        assert not node.is_op_mode_supported("HOMING")
        seen = []
        for state in STEPS:
            node.state = state
            seen.append(node.state)
        assert seen == STEPS
        node.state = "SWITCH ON DISABLED"
        assert node.state == "SWITCH ON DISABLED"


def test_its_torque_is_the_inverter_s_and_ends_with_the_state() -> None:
    with master() as (rig, node):
        node.sdo[0x6060].raw = 10
        node.state = "OPERATION ENABLED"
        rpdo = node.rpdo[1]
        rpdo[0x6071].raw = 200
        rpdo[0x60B2].raw = -50
        for _ in range(5):  # an RPDO on its way, the SYNC that takes it, the TPDO that tells
            assert node.tpdo[1].wait_for_reception(timeout=60.0) is not None
        assert rig.torque_nm[0] == pytest.approx(90.0)  # 150 per mille of 600 Nm
        assert node.tpdo[1][0x6077].raw == pytest.approx(150, abs=6)  # noise of one count
        node.state = "SWITCH ON DISABLED"
        assert rig.torque_nm[0] == 0.0


def test_it_sees_the_fault_and_its_emergency_and_resets_it() -> None:
    with master() as (rig, node):
        device = rig._nodes[0]._device
        node.state = "OPERATION ENABLED"
        device.fail(0x2310)
        emergency = node.emcy.wait(0x2310, timeout=60.0)
        assert emergency is not None
        assert emergency.register == 0x03
        node.tpdo[1].wait_for_reception(timeout=60.0)
        assert node.is_faulted()
        node.state = "SWITCH ON DISABLED"
        assert not node.is_faulted()
        assert node.sdo[0x603F].raw == 0


def test_it_reads_identity_pdo_mapping_and_a_refusal() -> None:
    with master() as (_, node):
        assert (node.sdo[0x1018][1].raw, node.sdo[0x1018][2].raw) == (0x3E7, 0x402)
        assert [hex(variable.index) for variable in node.rpdo[1].map] == ["0x6040", "0x6071", "0x60b2"]
        assert [hex(variable.index) for variable in node.tpdo[1].map] == ["0x6041", "0x6077", "0x606c"]
        with pytest.raises(canopen.SdoAbortedError, match="Value range of parameter exceeded"):
            node.sdo[0x6060].raw = 6
