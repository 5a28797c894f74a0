"""Files of measurement programs whose channels have times of their own: TDMS (NI), MCAP (robotics), logs of a CAN bus.

What a file holds becomes groups of channels that share a time; from there on they are read as the groups of an MDF file
are (`hil.recording.mdf_file`): the recording is made of those asked for, others are named, `resample_s` brings all
to one period. The libraries of TDMS and MCAP are of the extra ``formats``.
"""

from __future__ import annotations

import io
import json
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from importlib import import_module
from itertools import chain
from pathlib import Path
from typing import Any, Final

import numpy as np

from drivers.foreign_file import open_regular, read_regular_text
from hil.errors import RecordingError
from hil.recording.bounds import damaged, require_cells
from hil.recording.bus_database import DATA_SHEETS, database_of
from hil.recording.mdf_file import foreign_table, foreign_tables
from hil.recording.request import Request
from hil.recording.table import Column, Table, as_column, is_column
from hil.version import install_hint

NS: Final = 1e-9

MOST_ODD_LINES: Final = 0.01
"""Share of the lines of a log that may be none of its form, skipped and counted; beyond, the log is damaged."""

EVENT: Final = re.compile(r"\s*\(?\d")
"""What a line of a text log begins with that is a frame, or should be one."""

HEAD_LINES: Final = 40  # lines among which a log says in which form it is

HEADS: Final = (";", "date", "base", "internal", "//")

FEW_ODD_LINES: Final = 3  # lines that may be odd in a log of any length: its beginning is often cut


@dataclass(slots=True)
class Group:
    """Channels that share a time [s]; shapes (n,)."""

    time_s: Column  # of each row
    channels: dict[str, Column] = field(default_factory=dict)  # by name in the table
    units: dict[str, str] = field(default_factory=dict)  # by channel; one that is missing or empty has no known unit


def read(path: Path, request: Request) -> Table:
    """Read the channels asked for, or those that share the time of most."""
    return table_of(path, *_groups(path, request), request)


def read_all(path: Path, request: Request) -> list[Table]:
    """Read all channels, a table for each time."""
    return tables_of(path, *_groups(path, request), request)


def table_of(path: Path, groups: Iterable[Group], remarks: Iterable[str], request: Request) -> Table:
    """Return the channels asked for among groups, or those that share the time of most."""
    table = foreign_table(path, _as_mdf(groups), replace(request, dbc=None))
    return replace(table, remarks=(*remarks, *table.remarks), metadata={})


def tables_of(path: Path, groups: Iterable[Group], remarks: Iterable[str], request: Request) -> list[Table]:
    """Return all channels of groups, a table for each time."""
    tables = foreign_tables(path, _as_mdf(groups), replace(request, dbc=None))
    return [replace(table, remarks=(*remarks, *table.remarks)) for table in tables]


def _groups(path: Path, request: Request) -> tuple[list[Group], list[str]]:
    """Return what a file holds, and what is to be said of it."""
    match path.suffix.lower():
        case ".tdms":
            return _tdms(path), []
        case ".mcap":
            return _mcap(path), []
        case _:
            return _bus_log(path, request)


def _as_mdf(groups: Iterable[Group]) -> Any:
    from asammdf import MDF, Signal

    mdf = MDF()
    for group in groups:
        signals = [
            Signal(values, group.time_s, name=name, unit=group.units.get(name, ""))
            for name, values in group.channels.items()
        ]
        if signals:
            mdf.append(signals)
    return mdf


def library(path: Path, module: str, package: str) -> Any:
    """Import the library of a format, or say how to get it."""
    try:
        return import_module(module)
    except ImportError:
        raise RecordingError(
            path,
            f"expected the library {package}, which reads {path.suffix} files, got none. Install it: "
            f"{install_hint('formats')}; or save the recording as Parquet or CSV.",
        ) from None


# --- TDMS


def _tdms(path: Path) -> list[Group]:
    """Read a TDMS file of LabVIEW or DIAdem."""
    nptdms = library(path, "nptdms", "npTDMS")
    groups: dict[bytes, Group] = {}
    try:
        with nptdms.TdmsFile.open(path) as file:
            channels = [channel for group in file.groups() for channel in group.channels()]
            require_cells(path, sum(len(channel) for channel in channels))
            for channel in channels:
                values = channel[:]
                if not len(values) or not is_column(values):
                    continue
                time_s = _tdms_time(channel, len(values))
                group = groups.setdefault(np.ascontiguousarray(time_s).tobytes(), Group(time_s))
                group.channels[str(channel.name)] = as_column(values)
                group.units[str(channel.name)] = str(channel.properties.get("unit_string", ""))
    except RecordingError:
        raise
    except Exception as error:  # the library raises anything on a damaged file
        raise damaged(path, "a whole TDMS file", error) from error
    return list(groups.values())


def _tdms_time(channel: Any, n: int) -> Column:
    """Return the times of a channel: of its waveform's properties, else the numbers of its values."""
    step_s = float(channel.properties.get("wf_increment", 0.0)) or 1.0
    return float(channel.properties.get("wf_start_offset", 0.0)) + step_s * np.arange(n)


# --- MCAP


def _mcap(path: Path) -> list[Group]:
    """Read an MCAP file whose messages are JSON."""
    reader = library(path, "mcap.reader", "mcap")
    rows: dict[str, list[tuple[int, dict[str, float]]]] = {}
    others: set[str] = set()
    try:
        with open_regular(path) as file:
            for _, channel, message in reader.make_reader(file).iter_messages():
                if channel.message_encoding != "json":
                    others.add(f"{channel.topic} ({channel.message_encoding})")
                    continue
                topic = str(channel.topic).strip("/").replace("/", ".")
                rows.setdefault(topic, []).append((message.log_time, dict(_leaves("", json.loads(message.data)))))
    except Exception as error:  # the library raises anything on a damaged file
        raise damaged(path, "a whole MCAP file", error) from error
    if not rows and others:
        raise RecordingError(
            path, f"expected messages in JSON, got {', '.join(sorted(others))}. Export the topic as CSV or Parquet."
        )
    return [_topic(topic, messages, len(rows) > 1) for topic, messages in rows.items()]


def _leaves(name: str, value: Any) -> Iterator[tuple[str, float]]:
    """Yield the numbers of a message with their place in it."""
    if isinstance(value, Mapping):
        yield from chain.from_iterable(_leaves(f"{name}.{key}".strip("."), each) for key, each in value.items())
    elif isinstance(value, int | float):
        yield name, float(value)


def _topic(topic: str, messages: list[tuple[int, dict[str, float]]], is_one_of_several: bool) -> Group:
    start = messages[0][0]
    names = dict.fromkeys(chain.from_iterable(values for _, values in messages))
    group = Group(np.array([(stamp - start) * NS for stamp, _ in messages]))
    for name in names:
        called = f"{topic}.{name}" if is_one_of_several else name
        group.channels[called] = np.array([values.get(name, np.nan) for _, values in messages])
    return group


# --- logs of a CAN bus


def _bus_log(path: Path, request: Request) -> tuple[list[Group], list[str]]:
    """Read the frames of a bus as a logger keeps them (BLF, ASC, candump, TRC), as the signals of a DBC file."""
    if request.dbc is None:
        raise RecordingError(
            path, "expected signals, got the frames of a bus as they were logged. Say what they mean: --dbc FILE"
        )
    known = {message.frame_id: message for message in database_of(path, request.dbc).messages}
    rows: dict[int, list[tuple[float, bytes]]] = {}
    log = _Log(path)
    for frame in log:
        if not frame.is_error_frame and not frame.is_remote_frame and frame.arbitration_id in known:
            rows.setdefault(frame.arbitration_id, []).append((frame.timestamp, bytes(frame.data)))
    if not rows:
        raise RecordingError(
            path,
            f"--dbc {request.dbc}: expected a description of the frames in this file, got none of its "
            f"{log.frames} frames described. Is it of another bus?",
        )
    if request.dbc.suffix.lower() in DATA_SHEETS:
        _require_mapped(path, request.dbc, known, rows)
    start = min(frames[0][0] for frames in rows.values())
    groups = [_message(known[number], frames, start) for number, frames in rows.items()]
    odd = [f"{log.odd} lines skipped that are no frames"] if log.odd else []
    return groups, odd


def _require_mapped(
    path: Path, sheet: Path, known: Mapping[int, Any], rows: Mapping[int, list[tuple[float, bytes]]]
) -> None:
    """Refuse a data sheet by which frames have other lengths than they have in the log."""
    others = [
        f"0x{number:03X} has {len(frames[0][1])} bytes and {known[number].length} in the file"
        for number, frames in rows.items()
        if all(len(data) != known[number].length for _, data in frames)
    ]
    if others:
        raise RecordingError(
            path,
            f"--dbc {sheet}: expected PDOs as this file maps them, got others: {'; '.join(others)}. The drive was "
            "mapped otherwise: give a DCF as it was set up, or a DBC file.",
        )


def _message(message: Any, frames: list[tuple[float, bytes]], start: float) -> Group:
    """Decode the frames of one message; a frame that is too short has no values."""
    decoded = []
    for _, data in frames:
        try:
            decoded.append(message.decode(data, decode_choices=False, allow_truncated=True))
        except (ValueError, KeyError):
            decoded.append({})
    group = Group(np.array([stamp - start for stamp, _ in frames]))
    for signal in message.signals:
        group.channels[signal.name] = np.array([float(values.get(signal.name, np.nan)) for values in decoded])
        group.units[signal.name] = str(signal.unit or "")
    return group


class _Log:
    """The frames of a log by python-can; lines of a text log that it can't read are skipped and counted."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.frames = self.odd = 0

    def __iter__(self) -> Iterator[Any]:
        import can

        if self.path.suffix.lower() == ".blf":
            yield from self._counted(can.BLFReader(self.path))
            return
        readers = {".asc": can.ASCReader, ".log": can.CanutilsLogReader, ".trc": can.TRCReader}
        lines = read_regular_text(self.path, errors="replace").splitlines(keepends=True)
        head = [line for line in lines[:HEAD_LINES] if line.startswith(HEADS)]
        events = sum(EVENT.match(line) is not None for line in lines)
        faults = 0
        while lines:
            source = _Lines(lines)
            try:
                yield from self._counted(readers[self.path.suffix.lower()](source))
                lines = []
            except (ValueError, IndexError, KeyError, NotImplementedError, AttributeError, AssertionError) as error:
                faults += 1
                if source.read_lines == 0 or faults > MOST_ODD_LINES * events + FEW_ODD_LINES:
                    raise damaged(self.path, "a whole log of a bus", error) from error
                rest = lines[source.read_lines :]
                lines = [*head, *rest] if rest else []
        self.odd = events - self.frames  # python-can leaves some out without a word

    def _counted(self, frames: Iterable[Any]) -> Iterator[Any]:
        try:
            for frame in frames:
                self.frames += 1
                yield frame
        except Exception as error:
            if self.path.suffix.lower() == ".blf":
                raise damaged(self.path, "a whole log of a bus", error) from error
            raise


class _Lines(io.StringIO):  # typeshed has its lines as bytes
    """Lines of a text that count how many were read."""

    def __init__(self, lines: list[str]) -> None:
        super().__init__("".join(lines))
        self.read_lines = 0

    def readline(self, size: int | None = -1, /) -> str:  # type: ignore[override]
        line = super().readline(-1 if size is None else size)
        self.read_lines += bool(line)
        return line

    def __next__(self) -> str:  # type: ignore[override]
        line = self.readline()
        if not line:
            raise StopIteration
        return line
