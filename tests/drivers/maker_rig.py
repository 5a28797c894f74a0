"""A drive by its maker's file, all the way: rig file written, drive simulated, checked, run and checked again."""

from dataclasses import dataclass
from pathlib import Path

from drivers.inverter.check import Difference
from hil.config.new_rig import answers, new_drive, rig_text
from hil.config.rig_file import Rig, read_rig
from hil.rig.build import open_devices
from hil.rig.pacing import FREE_PATIENCE_S
from tests.rig.serving import Samples, changed, run, served

SAMPLES = 400


@dataclass(frozen=True)
class Driven:
    """What came of it.

    ``before`` and ``after`` are the differences found before and after the run; ``prbs_kept`` whether the recording
    has the PRBS apart from the reference.
    """

    recorded: int
    flagged: int
    before: tuple[Difference, ...]
    after: tuple[Difference, ...]
    samples: Samples


def written_rig(eds: Path, folder: Path) -> Rig:
    """Write a rig file as ``hil rig new --eds FILE --simulated --yes`` does, and read it."""
    path = folder / "rig.toml"
    drive = new_drive(eds, path, simulated=True)
    path.write_text(rig_text(answers({}, True, None, drive.defaults), path, True, drive.lines), encoding="utf-8")
    return read_rig(path)


def drive(eds: Path, folder: Path, samples: int = SAMPLES) -> Driven:
    """Drive a cruise with two such drives, on a light vehicle so that it soon has its speed."""
    rig = written_rig(eds, folder)
    quick = {
        "vehicle": {"inertia_kg_m2": 10.0},
        "experiments.cruise": {"duration_s": samples * rig.period_s, "speed_rad_s": 0.4, "approach_timeout_s": 20.0},
        "simulation": {"speed_noise_rad_s": 0.0, "torque_noise_permille": 0.5},
    }
    kept = Samples()
    with served(changed(rig, quick)) as (_, at), open_devices(at, FREE_PATIENCE_S) as devices:
        before = (*devices.m1.check(), *devices.m2.check())
        summary = run(at, devices, kept)
        after = (*devices.m1.check(), *devices.m2.check())
    return Driven(summary.recorded, summary.flagged, before, after, kept)
