"""The decoders of what comes from a bus, and the frames their mutants are made of.

An input is a row of frames, each a byte that chooses who it is for, one with its length, and its data.
"""

import asyncio
import itertools
import struct
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path

from drivers.canopen.can_link import CanLink
from drivers.canopen.heartbeat import NmtState
from drivers.canopen.node_monitor import NodeMonitor
from drivers.canopen.sdo import SdoChannel, SdoNode
from drivers.errors import BusDown, DriverError
from drivers.inverter.inverter import Inverter
from drivers.inverter.pdos import InverterPdos
from drivers.plc.modbus_link import ModbusLink
from drivers.plc.named_registers import reading
from drivers.plc.register import RegisterKind
from drivers.plc.register_map import load_register_map
from tests.campaigns.fuzz.target import Read, Target
from tests.drivers.can_bench import M1, Bench, bench, frame, guarded
from tests.drivers.modbus_peers import peer

ROOT = Path(__file__).resolve().parents[3]

Frame = tuple[int, bytes]


def encoded(frames: Sequence[Frame]) -> bytes:
    """Write frames as one input."""
    return b"".join(bytes((who, len(data))) + data for who, data in frames)


def decoded(data: bytes) -> Iterator[Frame]:
    """Read an input as frames of at most 8 bytes."""
    at = 0
    while at + 2 <= len(data):
        who, length = data[at], data[at + 1] % 9
        yield who, data[at + 2 : at + 2 + length]
        at += 2 + length


_ENDLESS = b"\x01"
"""First byte of an input whose frames, but for the first answer, come again and again."""


class _Answering:
    """A network on which every request is answered by the next frames of an input."""

    def __init__(self) -> None:
        self.frames: Iterator[Frame] = iter(())
        self.take: Callable[[int, bytes, float], None] = lambda cob_id, data, timestamp: None

    def subscribe(self, cob_id: int, callback: Callable[[int, bytes, float], None]) -> None:
        if cob_id == 0x580 + M1.node_id:
            self.take = callback

    def unsubscribe(self, cob_id: int, callback: object = None) -> None:
        """Nothing to forget."""

    def send_message(self, cob_id: int, data: bytes, remote: bool = False) -> None:
        for _, answer in itertools.islice(self.frames, 2):
            with suppress(DriverError):  # raised where frames are received
                self.take(cob_id, answer, 0.0)


@contextmanager
def _sdo(folder: Path) -> Iterator[Read]:
    """The host's SDO client: numbers and texts read and written, answered by an input."""
    pdos = InverterPdos(M1)

    def read(data: bytes) -> None:
        network = _Answering()
        node = SdoNode(M1.node_id, pdos.eds.dictionary)
        node.associate_network(network)
        channel = SdoChannel(node, pdos.eds, "m1", 0.0005)
        frames = decoded(data[1:])
        endless = data[:1] == _ENDLESS
        network.frames = itertools.chain(itertools.islice(frames, 2), itertools.cycle(frames)) if endless else frames
        for ask in (
            lambda: channel.upload(0x6076),
            lambda: channel.download_confirmed(0x6060, 0, 10),
            lambda: channel.upload(0x1018, 1),
        ):
            with suppress(DriverError):
                ask()

    yield read


def _sdo_seeds(folder: Path) -> list[bytes]:
    rated = (0, struct.pack("<BHBI", 0x43, 0x6076, 0, 600_000))
    name = [(0, struct.pack("<BHBI", 0x41, 0x1008, 0, 10)), (0, b"\x00drive 1"), (0, b"\x19 m1\0\0\0\0")]
    mode = [(0, struct.pack("<BHB4x", 0x60, 0x6060, 0)), (0, struct.pack("<BHBI", 0x4F, 0x6060, 0, 10))]
    vendor = (0, struct.pack("<BHBI", 0x43, 0x1018, 1, 7))
    abort = (0, struct.pack("<BHBI", 0x80, 0x6076, 0, 0x06020000))
    silent = (0, b"")
    talk = [each for answer in (*name, rated, *mode, vendor) for each in (answer, silent)]
    endless = [(0, struct.pack("<BHBI", 0x41, 0x1008, 0, 10)), silent]
    endless += [each for toggle in (0x00, 0x10) for each in ((0, bytes((toggle,)) + b"drive 1"), silent)]
    once = [encoded(each) for each in (talk, [abort, silent, *talk], [vendor, rated, *talk])]
    return [*(b"\0" + each for each in once), _ENDLESS + encoded(talk), _ENDLESS + encoded(endless)]


@contextmanager
def _pdo(folder: Path) -> Iterator[Read]:
    """The host's TPDOs, and its RPDOs read back."""
    pdos = InverterPdos(M1)

    def read(data: bytes) -> None:
        receiver = pdos.receiver()
        receiver.start_anew()
        for who, content in decoded(data):
            with suppress(DriverError):
                for _, take in receiver.subscriptions:
                    take(content, who)
                pdos.unpack(pdos.rpdos[who % len(pdos.rpdos)], content)

    yield read


def _pdo_seeds(folder: Path) -> list[bytes]:
    return [encoded([(k, struct.pack("<Hhi", 0x1637, 100 * k, 1000)) for k in range(4)] + [(0, b"\x0f\0\x10\0\0\0")])]


@contextmanager
def _health(folder: Path) -> Iterator[Read]:
    """Heartbeats and emergencies of one node."""

    def read(data: bytes) -> None:
        monitor = NodeMonitor("m1", 10_000_000)
        monitor.expect(NmtState.OPERATIONAL)
        for k, (who, content) in enumerate(decoded(data)):
            with suppress(DriverError):
                (monitor.on_emergency if who % 2 else monitor.on_heartbeat)(content, k)
            with suppress(DriverError):
                monitor.raise_if_unwell(k)

    yield read


def _health_seeds(folder: Path) -> list[bytes]:
    emergency = struct.pack("<HB5s", 0x2310, 2, b"12345")
    return [encoded([(0, b"\0"), (0, b"\x7f"), (0, b"\x05"), (1, emergency), (1, bytes(8)), (0, b"\x04")])]


@contextmanager
def _registers(folder: Path) -> Iterator[Read]:
    """Words as every register of the map takes them."""
    map_ = load_register_map(ROOT / "eds" / "plc.toml")

    def read(data: bytes) -> None:
        words = struct.unpack(f"<{len(data) // 2}H", data[: len(data) // 2 * 2])
        for name, register in map_.registers.items():
            found = reading(name, register, words[: register.size])
            with suppress(DriverError):
                found.required()
            str(found.shown)

    yield read


def _register_seeds(folder: Path) -> list[bytes]:
    return [struct.pack("<2H", *words) for words in ((0, 0), (1, 0), (0x42C8, 0), (0, 0x42C8), (0x7FC0, 0), (3, 1))]


@contextmanager
def _modbus(folder: Path) -> Iterator[Read]:
    """The host's Modbus client, answered by an input over TCP."""
    answers: list[bytes] = []

    def answer(request: bytes) -> bytes:
        return answers.pop(0) if answers else b""

    async def ask(port: int) -> None:
        link = ModbusLink("127.0.0.1", port, 1, 0.02)
        await link.open()
        try:
            for kind in RegisterKind:
                with suppress(DriverError):
                    await link.read(kind, 10, 2)
            with suppress(DriverError):
                await link.write(RegisterKind.HOLDING_REGISTER, 10, (1, 2))
        finally:
            link.close()

    async def converse(data: bytes) -> None:
        async with peer(answer) as port:
            answers[:] = data.split(_SEPARATOR)
            await ask(port)

    yield lambda data: asyncio.run(converse(data))


_SEPARATOR = b"\xa5\x5a\xa5"


def _modbus_seeds(folder: Path) -> list[bytes]:
    pdus = (b"\x01\x01\x03", b"\x02\x01\x03", b"\x03\x04\0\1\0\2", b"\x04\x04\0\1\0\2", b"\x10\0\x0a\0\x02")
    refusal = (b"\x81\x02", *pdus[1:])
    return [
        _SEPARATOR.join(struct.pack(">HHHB", k, 0, len(pdu) + 1, 1) + pdu for k, pdu in enumerate(each, start=1))
        for each in (pdus, refusal)
    ]


_COB_IDS = (0x000, 0x080, 0x080 + M1.node_id, 0x180 + M1.node_id, 0x200 + M1.node_id, 0x580 + M1.node_id)
_COB_IDS += (0x600 + M1.node_id, 0x700 + M1.node_id, 0x77F, 0x7FF)

_PATIENT = replace(M1, host_timeout_ms=60_000, rpdo_deadline_ms=60_000, state_timeout_s=30.0)
"""A busy machine is no fault."""

MOST_INPUTS = 40
"""After so many a bench is made anew: drives that are in fault, or switched off, hide what is behind."""


@contextmanager
def _bus(folder: Path) -> Iterator[Read]:
    """A host and two simulated drives on one bus, on which a third device sends an input."""
    inputs = 0
    scene: Generator[Bench, None, None] | None = None

    def fresh() -> Generator[Bench, None, None]:
        with bench(settings=_PATIENT) as rig:
            for inverter in (rig.m1, rig.m2):
                inverter.configure()
            rig.m1.arm()
            rig.cycle(guarded(120.0))
            while True:
                yield rig

    def read(data: bytes) -> None:
        nonlocal inputs, scene
        if scene is None or inputs % MOST_INPUTS == 0:
            if scene is not None:
                scene.close()  # raises what a callback raised
            scene = fresh()
        inputs += 1
        try:
            _disturb(next(scene), data)
        except Exception:
            broken, scene = scene, None
            broken.close()  # here: collected later, it would be closed by a thread that it waits for
            raise

    try:
        yield read
    finally:
        if scene is not None:
            scene.close()


def _disturb(rig: Bench, data: bytes) -> None:
    with rig.intruder() as intruder:
        for who, content in decoded(data):
            intruder.send(frame(_COB_IDS[who % len(_COB_IDS)], content))
    for link in (rig.link, rig.rig._link):
        _require_alive(link)
    for inverter in (rig.m1, rig.m2):
        _look(inverter)


def _require_alive(link: CanLink) -> None:
    """See that nothing but a violation of the protocol has been met."""
    try:
        link.raise_if_failed()
    except BusDown as error:
        raise AssertionError("a frame has ended the receiving of a bus") from error
    except DriverError:
        pass


def _look(inverter: Inverter) -> None:
    with suppress(DriverError):
        inverter.raise_if_faulted()


def _bus_seeds(folder: Path) -> list[bytes]:
    """One frame for each identifier, and a configuration by SDO as a master does it."""
    node = M1.node_id
    requests = [struct.pack("<BHBI", *each) for each in ((0x40, 0x1000, 0, 0), (0x23, 0x1400, 1, 0x200 + node))]
    requests += [struct.pack("<BHBI", 0x40, 0x1008, 0, 0), b"\x60" + bytes(7), b"\x70" + bytes(7)]
    requests += [struct.pack("<BHBI", 0x2F, 0x1A00, 0, 0), struct.pack("<BHBI", 0x2F, 0x6060, 0, 10)]
    frames = [(6, request) for request in requests]
    frames += [(0, bytes((command, node))) for command in (1, 2, 128, 129, 130)] + [(1, b""), (1, b"\x01")]
    frames += [(4, struct.pack("<Hhh", 0x0F, 10, 0)), (3, struct.pack("<Hhi", 0x1637, 1, 2)), (8, b"\x05")]
    frames += [
        (2, struct.pack("<HB5s", 0x2310, 2, b"12345")),
        (7, b"\x05"),
        (5, struct.pack("<BHBI", 0x43, 0x6041, 0, 7)),
    ]
    return [encoded(frames), *(encoded([each]) for each in frames)]


BUSES: dict[str, Target] = {
    "sdo": Target(_sdo_seeds, _sdo, names_file=False),
    "pdo": Target(_pdo_seeds, _pdo, names_file=False),
    "health": Target(_health_seeds, _health, names_file=False),
    "plc registers": Target(_register_seeds, _registers, names_file=False),
    "modbus": Target(_modbus_seeds, _modbus, names_file=False),
    "bus": Target(_bus_seeds, _bus, names_file=False),
}
