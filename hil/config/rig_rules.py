"""Rules across the tables of a rig file, looked at once every table is right by itself.

Those on torques take the worst case of each experiment against the limits of the torque guard: what the run would
refuse is refused before it.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from drivers.plc.types import PrbsSource
from hil.config.experiment_tables import EVEN_SHARE
from hil.problems import Fault

if TYPE_CHECKING:
    from hil.config.rig_file import Rig


def faults_across_tables(rig: Rig) -> Iterator[Fault]:
    """Find every rule across tables that a rig file breaks."""
    for faults in (
        _guard_faults,
        _deadline_faults,
        _node_faults,
        _channel_faults,
        _prbs_faults,
        _experiment_faults,
        _security_faults,
    ):
        yield from faults(rig)


def _guard_faults(rig: Rig) -> Iterator[Fault]:
    both_nm = rig.inverters.m1.torque_limit_nm + rig.inverters.m2.torque_limit_nm
    if rig.guard.sum_limit_nm > both_nm:
        expected = f"at most the torque limits of m1 and m2 together ({both_nm:g})"
        yield Fault("guard.sum_limit_nm", expected, rig.guard.sum_limit_nm)
    if rig.guard.feedback_timeout_s < rig.period_s:
        expected = f"at least one period ({rig.period_s:g})"
        yield Fault("guard.feedback_timeout_s", expected, rig.guard.feedback_timeout_s)


def _deadline_faults(rig: Rig) -> Iterator[Fault]:
    least_ms = 2000.0 * rig.period_s
    for name, table in (("m1", rig.inverters.m1), ("m2", rig.inverters.m2)):
        if table.rpdo_deadline_ms is not None and table.rpdo_deadline_ms < least_ms:
            expected = f"at least two periods ({least_ms:g}), or one RPDO that is late stops the drive"
            yield Fault(f"inverters.{name}.rpdo_deadline_ms", expected, table.rpdo_deadline_ms)


def _node_faults(rig: Rig) -> Iterator[Fault]:
    """See that every node has an id of its own."""
    used = [rig.inverters.m1.node_id, rig.inverters.m2.node_id]
    for name in ("host_node_id", "monitor_node_id"):
        node_id = getattr(rig.can, name)
        if node_id in used:
            yield Fault(f"can.{name}", f"another node id than {', '.join(map(str, used))}", node_id)
        elif node_id is not None:
            used.append(node_id)


def _channel_faults(rig: Rig) -> Iterator[Fault]:
    """See that every channel has a column of its own."""
    names = [channel.column for channel in rig.channels]
    for number, name in enumerate(names):
        if name in names[:number]:
            yield Fault(f"channels.{number}.column", "another column than the channels before it", name)
    noisy = {} if rig.simulation is None else rig.simulation.channel_noise
    for name in (name for name in noisy if name not in names):
        yield Fault(f"simulation.channel_noise.{name}", f"a column of [[channels]] ({', '.join(names)})", noisy[name])


def _security_faults(rig: Rig) -> Iterator[Fault]:
    """See that the simulated PLC wants TLS if, and only if, the host speaks it."""
    if rig.simulation is not None and (rig.plc.security is None) != (rig.simulation.plc_security is None):
        expected = "this table if and only if there is [plc.security]: both sides speak TLS, or neither"
        yield Fault("simulation.plc_security", expected, rig.simulation.plc_security and {})


def _prbs_faults(rig: Rig) -> Iterator[Fault]:
    largest_nm = max(rig.prbs.parts_nm.values())
    if largest_nm > rig.guard.prbs_limit_nm:
        expected = (
            f"a part of at most guard.prbs_limit_nm ({rig.guard.prbs_limit_nm:g}) for each inverter, "
            f"but one carries {largest_nm:g}"
        )
        yield Fault("prbs.amplitude_nm", expected, rig.prbs.amplitude_nm)
    if rig.prbs.source is PrbsSource.PLC:
        yield from _room_faults(rig)


def _room_faults(rig: Rig) -> Iterator[Fault]:
    """See that a PRBS the PLC adds by itself leaves the guard something to guard."""
    for rest_nm, of in _torque_rests(rig, EVEN_SHARE):
        if rest_nm <= 0.0:
            expected = f"less than {of} allows, since source is 'plc'"
            yield Fault("prbs.amplitude_nm", expected, rig.prbs.amplitude_nm)


def _experiment_faults(rig: Rig) -> Iterator[Fault]:
    for name, experiment in rig.experiments.items():
        key = f"experiments.{name}"
        for rest_nm, of in _torque_rests(rig, experiment.share_m1):
            if experiment.torque_nm > rest_nm:
                expected = f"at most {rest_nm:g}, what {of} leaves besides the PRBS"
                yield Fault(f"{key}.torque_nm", expected, experiment.torque_nm)
        fastest = rig.guard.rate_limit_nm_per_s / max(experiment.share_m1, 1.0 - experiment.share_m1)
        if experiment.slew_nm_per_s > fastest:
            expected = f"at most {fastest:g}, of which one inverter gets what guard.rate_limit_nm_per_s allows"
            yield Fault(f"{key}.slew_nm_per_s", expected, experiment.slew_nm_per_s)


def _torque_rests(rig: Rig, share_m1: float) -> Iterator[tuple[float, str]]:
    """Largest base torque of both inverters that each limit leaves besides the PRBS [Nm], and its key.

    ``share_m1`` is the part of the base torque that inverter m1 gives, 0 to 1.
    """
    parts_nm = rig.prbs.parts_nm
    yield rig.guard.sum_limit_nm - rig.prbs.amplitude_nm, "guard.sum_limit_nm"
    for name, table, share in (("m1", rig.inverters.m1, share_m1), ("m2", rig.inverters.m2, 1.0 - share_m1)):
        if share > 0.0:
            yield (table.torque_limit_nm - parts_nm[name]) / share, f"inverters.{name}.torque_limit_nm"
