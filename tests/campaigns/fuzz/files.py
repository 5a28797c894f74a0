"""The readers of files, and the small whole files their mutants are made of."""

import io
import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any

import can
import numpy as np

from drivers.eds_check.check import check_eds
from drivers.inverter.pdos import InverterPdos
from drivers.inverter.settings import InverterSettings
from drivers.plc.register_map import load_register_map
from estimator.identification.online.adaptation import DecreasingGain
from hil.cli.main import run
from hil.config.model_file import read_model_for_recordings
from hil.config.rig_file import read_rig
from hil.export.plc_estimator import plc_estimator
from hil.export.structured_text import Precision, structured_text
from hil.recording import Table, read_table, write_table
from hil.recording.formats import read_metadata
from hil.recording.signals import read_record
from hil.recording.table import as_text
from hil.rig.replay import replay
from hil.store import RunStore, register_run
from tests.campaigns.fuzz.target import Read, Target, file_target

ROOT = Path(__file__).resolve().parents[3]

ROWS = 40


def _table(path: Path) -> Table:
    dice = np.random.default_rng(5)
    columns: dict[str, Any] = {"time_s": 0.01 * np.arange(ROWS)}
    columns |= {name: dice.normal(size=ROWS) for name in ("torque_m1_nm", "torque_m2_nm", "speed_rad_s")}
    columns |= {"flags": np.zeros(ROWS, np.int64), "on": dice.random(ROWS) > 0.5}
    columns |= {"gear": as_text([f"gear {k % 3}" for k in range(ROWS)])}
    return Table(path, columns, {"time_s": "s", "speed_rad_s": "rad/s"}, {"experiment": "tip", "rig_file": "name = 1"})


def _recordings(suffix: str) -> Callable[[Path], list[bytes]]:
    def seeds(folder: Path) -> list[bytes]:
        path = folder / f"seed{suffix}"
        write_table(_table(path), path, replace=True)
        return [path.read_bytes()]

    return seeds


def _read_recording(path: Path) -> None:
    read_metadata(path)
    read_record(path)


def _csv_seeds(folder: Path) -> list[bytes]:
    own = _recordings(".csv")(folder)[0]
    return [own, own.replace(b",", b";"), own.decode().encode("utf-16"), b'time_s,"speed, rad_s"\r\n0,1\r\n0.01,2\r\n']


def _parquet_seeds(folder: Path) -> list[bytes]:
    import pyarrow as pa
    import pyarrow.parquet

    path = folder / "foreign.parquet"
    foreign = {name: pa.array(column) for name, column in _table(path).columns.items()}
    foreign |= {"when": pa.array(range(ROWS), pa.timestamp("ns")), "l": pa.array([[1]] * ROWS)}
    pa.parquet.write_table(pa.table(foreign), path, compression="zstd")
    return [*_recordings(".parquet")(folder), path.read_bytes()]


def _mat_seeds(folder: Path) -> list[bytes]:
    import scipy.io

    seeds = _recordings(".mat")(folder)
    vectors = {name: column for name, column in _table(folder).columns.items() if name != "gear"}
    for options, more in (
        ({}, {"n": 3, "name": "tip", "c": {"a": 1}}),
        ({"do_compression": True}, {}),
        ({"format": "4"}, {}),
    ):
        scipy.io.savemat(folder / "foreign.mat", {**vectors, **more}, **options)
        seeds.append((folder / "foreign.mat").read_bytes())
    return seeds


def _mdf_seeds(folder: Path) -> list[bytes]:
    from asammdf import MDF, Signal

    seeds = _recordings(".mf4")(folder)
    for version in ("4.10", "3.30"):
        path = folder / f"foreign{version}.{'mf4' if version > '4' else 'mdf'}"
        with MDF(version=version) as mdf:
            columns = _table(path).columns
            signals = [
                Signal(columns[name], columns["time_s"], name=name)
                for name in ("torque_m1_nm", "torque_m2_nm", "speed_rad_s")
            ]
            mdf.append(signals)
            mdf.save(path, overwrite=True)
        seeds.append(path.read_bytes())
    return seeds


def _frames() -> Iterator[can.Message]:
    for k in range(12):
        for cob_id, data in (
            (0x080, b""),
            (0x181, bytes((0x37, 0x16, k, 0, 0, 0, 0, 0))),
            (0x182, bytes((0x37, 0x16, k, 0, 0, 0, 0, 0))),
            (0x201, bytes((0x0F, 0, k, 0, 5, 0))),
            (0x202, bytes((0x0F, 0, k, 0, 0, 0))),
        ):
            yield can.Message(10.0 + 0.01 * k, cob_id, False, data=data, channel=0, dlc=len(data))


def _traces(suffix: str) -> Callable[[Path], list[bytes]]:
    def seeds(folder: Path) -> list[bytes]:
        with can.Logger(folder / f"seed{suffix}") as logger:
            for frame in _frames():
                logger(frame)
        return [(folder / f"seed{suffix}").read_bytes()]

    return seeds


def _replay(path: Path) -> None:
    for whole in (True, False):
        list(replay(path, _RIG, whole=whole))


_RIG = read_rig(ROOT / "examples" / "rig.toml")


def _texts(*names: str) -> Callable[[Path], list[bytes]]:
    return lambda folder: [(ROOT / name).read_bytes() for name in names]


def _rig_seeds(folder: Path) -> list[bytes]:
    """Whole rig files, whose files of other kinds are found from any folder."""
    texts = [(ROOT / "examples" / name).read_text("utf-8") for name in ("rig.toml", "other_drive.toml")]
    for name in ("other_drive.eds", "inverter.eds", "plc.toml", "rig.toml"):
        at = ROOT / ("examples" if (ROOT / "examples" / name).exists() else "eds") / name
        texts = [text.replace(f'"{name}"', f'"{at}"').replace(f'"../eds/{name}"', f'"{at}"') for text in texts]
    return [text.encode() for text in texts]


def _eds_seeds(folder: Path) -> list[bytes]:
    own = (ROOT / "eds" / "inverter.eds").read_bytes()
    dcf = own.replace(b"DefaultValue=", b"ParameterValue=1\r\nDefaultValue=", 6)
    return [own, dcf + b"\n[DeviceComissioning]\nNodeID=5\nBaudrate=500\nNodeName=m1\n"]


def _read_eds(path: Path) -> None:
    """Say what is wrong with it, and use it as a run does."""
    check_eds(path)
    InverterPdos(InverterSettings(name="input", node_id=5, rated_torque_nm=600.0, torque_limit_nm=400.0, eds_path=path))


def _identification_seeds(folder: Path) -> list[bytes]:
    settings = {"na": 2, "nb": 2, "nk": 1, "sample_time_s": 0.01, "high_pass_hz": 0.1}
    recording = {"name": "run_1", "output": "speed", "filter_L": [1.0, -1.9, 0.95]}
    return [json.dumps({"schema": "hil.identification/1", "settings": settings, "recordings": [recording]}).encode()]


def _export(path: Path) -> None:
    structured_text(plc_estimator(path, None, 0.01, DecreasingGain()), Precision.DOUBLE)


@contextmanager
def _sidecars(folder: Path) -> Iterator[Read]:
    path = folder / "input.csv"
    write_table(_table(path), path, replace=True)

    def read(data: bytes) -> None:
        path.with_name("input.csv.json").write_bytes(data)
        read_table(path)

    yield read


def _sidecar_seeds(folder: Path) -> list[bytes]:
    _recordings(".csv")(folder)
    return [(folder / "seed.csv.json").read_bytes()]


def _stored(folder: Path) -> list[Path]:
    """Make a list of two runs in a folder; return the files of one run, its note and its result."""
    for name in ("a.csv", "b.csv"):
        write_table(_table(folder / name), folder / name, replace=True)
        register_run(folder / name)
    with RunStore(folder) as store:
        store.note(1, "windy")
        store.attach(1, "alarm", json.dumps({"time_s": 1.0}))
        return sorted(store.path.glob("1.*json"))


def _read_store(folder: Path) -> None:
    """Read all of it; raises what keeps the list from being read, and what a command would not tell in words."""
    with RunStore(folder) as store:
        for found in store.find():
            store.get(found.run_id)
    terminal = io.TextIOWrapper(io.BytesIO(), "utf-8")
    with redirect_stdout(terminal), redirect_stderr(terminal):
        assert run(["runs", "--store", str(folder)]) == 0
        run(["runs", "show", "1", "--store", str(folder)])


def _store_seeds(folder: Path) -> list[bytes]:
    return [path.read_bytes() for path in _stored(folder)]


@contextmanager
def _stores(folder: Path) -> Iterator[Read]:
    """Put the changed text in the place of each file of a run in turn."""
    at = folder / "input"
    at.mkdir()
    whole = {path: path.read_bytes() for path in _stored(at)}

    def read(data: bytes) -> None:
        for path, content in whole.items():
            path.write_bytes(data)
            _read_store(at)
            path.write_bytes(content)

    yield read


FILES: dict[str, Target] = {
    "csv": file_target("input.csv", _read_recording, _csv_seeds, text=True),
    "sidecar": Target(_sidecar_seeds, _sidecars, text=True),
    "parquet": file_target("input.parquet", _read_recording, _parquet_seeds),
    "hdf5": file_target("input.h5", _read_recording, _recordings(".h5")),
    "matlab": file_target("input.mat", _read_recording, _mat_seeds),
    "mdf": file_target("input.mf4", _read_recording, _mdf_seeds),
    "blf": file_target("input.blf", _replay, _traces(".blf")),
    "asc": file_target("input.asc", _replay, _traces(".asc"), text=True),
    "log": file_target("input.log", _replay, _traces(".log"), text=True),
    "trc": file_target("input.trc", _replay, _traces(".trc"), text=True),
    "rig": file_target("input.toml", read_rig, _rig_seeds, text=True),
    "model": file_target(
        "input.toml",
        read_model_for_recordings,
        _texts("examples/electric_car.toml", "examples/joint.toml", "examples/emps.toml"),
        text=True,
    ),
    "registers": file_target("input.toml", load_register_map, _texts("eds/plc.toml"), text=True),
    "eds": file_target("input.eds", _read_eds, _eds_seeds, text=True),
    "identification": file_target("input.json", _export, _identification_seeds, text=True),
    "store": Target(_store_seeds, _stores, text=True),
}
