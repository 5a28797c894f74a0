"""The rig of the campaign: the example's, with every kind of experiment, made short, and a light vehicle."""

import struct
from functools import partial
from pathlib import Path

from drivers.canopen.can_link import CanLink
from hil.config.rig_file import Rig, read_rig
from tests.simulator.rigid_plant import RigidPlant

EXAMPLE = Path(__file__).resolve().parents[3] / "examples" / "rig.toml"

EXPERIMENTS = """
[experiments.cruise]
kind = "cruise"
duration_s = 0.6
speed_rad_s = 1.0
torque_nm = 500.0
slew_nm_per_s = 1000.0
[experiments.reversal]
kind = "reversal"
duration_s = 1.0
turning_speed_rad_s = 2.0
swing_nm = 200.0
torque_nm = 500.0
slew_nm_per_s = 2000.0
share_m1 = 0.65
[experiments.tip]
kind = "tip"
duration_s = 1.0
speed_rad_s = 1.0
step_nm = 300.0
step_s = 0.2
torque_nm = 500.0
slew_nm_per_s = 3000.0
share_m1 = 0.35
[experiments.pulses]
kind = "pulses"
duration_s = 1.0
step_nm = 100.0
step_s = 0.1
most_speed_rad_s = 5.0
slew_nm_per_s = 2000.0
[experiments.rest]
kind = "rest"
duration_s = 0.6
[simulation]
seed = 1
speed_noise_rad_s = 0.02
torque_noise_permille = 0.5
"""

QUICK = (
    ("heartbeat_ms = 100 ", "heartbeat_ms = 10 "),
    ("heartbeat_ms = 100\n", "heartbeat_ms = 10\nsdo_timeout_s = 0.2\n"),
    ("# sdo_timeout_s = 0.5 ", "sdo_timeout_s = 0.2 "),
)

INERTIA_KG_M2, DRAG_NM_S = 10.0, 0.5


PATIENT = (
    ("# host_timeout_ms = 150 ", "host_timeout_ms = 1000 "),
    ("sdo_timeout_s = 0.2\n", "sdo_timeout_s = 0.2\nhost_timeout_ms = 1000\n"),
)
"""In simulated time only: the host's heartbeat is of the wall clock, and the machine may be busy."""

LONG = (
    ("duration_s = 0.6", "duration_s = 10.0"),
    ("duration_s = 1.0", "duration_s = 10.0"),
    ("sdo_timeout_s = 0.2", "sdo_timeout_s = 1.0"),
)
"""By the wall clock only: what is looked at is how runs end, not whether a busy machine gets them to begin."""


def campaign_rig(folder: Path, by_the_clock: bool = False, inertia_kg_m2: float = INERTIA_KG_M2) -> Rig:
    """Write the rig file and read it."""
    vehicle = ("inertia_kg_m2 = 100.0", f"inertia_kg_m2 = {inertia_kg_m2}")
    text = EXAMPLE.read_text("utf-8").partition("[experiments.cruise]")[0] + EXPERIMENTS
    for before, after in (vehicle, *QUICK, *(LONG if by_the_clock else PATIENT)):
        assert before in text, before
        text = text.replace(before, after)
    path = folder / "rig.toml"
    path.write_text(text, "utf-8")
    return read_rig(path)


class WatchedPlant(RigidPlant):
    """A rigid vehicle that keeps, for each SYNC, the torques it was driven with and those of the last RPDOs [Nm]."""

    def __init__(self, rated_nm: float, inertia_kg_m2: float = INERTIA_KG_M2) -> None:
        super().__init__(inertia_kg_m2, DRAG_NM_S)
        self.torques_nm: list[tuple[float, float]] = []
        self.asked_nm: list[tuple[float, float]] = []
        self._rated_nm = rated_nm
        self._asked = {0x201: 0.0, 0x202: 0.0}

    def listen(self, link: CanLink) -> None:
        """Read the RPDOs of both drives on a bus: controlword, target torque, torque offset."""
        for cob_id in self._asked:
            link.subscribe(cob_id, partial(self._on_rpdo, cob_id))

    def _on_rpdo(self, cob_id: int, data: bytes, t_ns: int) -> None:
        _, target, offset = struct.unpack("<Hhh", data[:6])
        self._asked[cob_id] = (target + offset) * self._rated_nm / 1000.0

    def advance(self, torque_nm: tuple[float, float], duration_s: float) -> None:
        self.torques_nm.append(torque_nm)
        self.asked_nm.append((self._asked[0x201], self._asked[0x202]))
        super().advance(torque_nm, duration_s)
