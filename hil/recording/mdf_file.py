"""MDF files, opened with every fault put into words; those of other programs: which of many groups is the recording.

A file of a measurement tool has a group for each rate. The groups that share their time to the bit belong together. The
recording is made of those that have the channels asked for, or the most channels; what the others have is named.
Channels of different times are brought to one only by ``resample_s``: a sample that was made up is none.
"""

from __future__ import annotations

import io
import logging
import struct
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from drivers.foreign_file import open_regular, read_regular
from hil.errors import RecordingError
from hil.recording.bounds import damaged, require_columns
from hil.recording.bus_database import DATA_SHEETS, database_of
from hil.recording.request import Request
from hil.recording.resample import Series, resampled
from hil.recording.table import Column, ColumnKind, Table, as_column, is_column

if TYPE_CHECKING:
    from asammdf import MDF


DAMAGED = (
    OSError,
    ValueError,
    TypeError,
    KeyError,
    IndexError,
    AttributeError,
    OverflowError,
    MemoryError,
    AssertionError,
    RuntimeError,
    struct.error,
    zlib.error,
)
"""What asammdf raises, besides its own, on a file that is cut or damaged."""

FINISHED, UNFINISHED = b"MDF     ", b"UnFinMF "
"""Identification of a file whose writer came to its end, and of one whose did not (ASAM MDF 4.1, 5.5)."""

IDENTIFICATION_BYTES = 64

BUS_EVENT: Final = 2  # flag of a group of bus events, ``cg_flags`` (ASAM MDF 4.1, table 51)
ANY_BUS: Final = 0  # channel of the bus, as asammdf counts: every one


def is_unfinished(path: Path) -> bool:
    """Whether a file was left by a writer that did not come to its end."""
    with open_regular(path) as file:
        return file.read(len(UNFINISHED)) == UNFINISHED


@contextmanager
def opened(path: Path) -> Iterator[MDF]:
    """Open a file for reading; one that is not finalised is finalised in a copy.

    The copy is in memory, always: asammdf maps a file, and a mapped file that is cut while it is read ends the process.
    """
    from asammdf import MDF
    from asammdf.blocks.utils import MdfException

    content = read_regular(path)
    start = content[: len(FINISHED)]
    if len(content) < IDENTIFICATION_BYTES or start not in (FINISHED, UNFINISHED):
        raise RecordingError(
            path,
            f"expected a whole MDF file, one that begins with {FINISHED.decode()!r}, got one that begins "
            f"with {start!r}",
        )
    try:
        with _quiet(), MDF(io.BytesIO(content)) as mdf:
            yield mdf
    except (*DAMAGED, MdfException) as error:
        what = "one that can be finalised: its writer never finished it" if is_unfinished(path) else "a whole MDF file"
        raise damaged(path, what, error) from error


def channels_of(mdf: MDF, group: int) -> list[Any]:
    """Return the channels of one group, master and all."""
    groups: list[Any] = list(mdf.groups)
    return list(groups[group].channels)


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep asammdf from printing tracebacks of what it raises as well."""
    logger = logging.getLogger("asammdf")
    before = logger.disabled
    logger.disabled = True
    try:
        with redirect_stdout(io.StringIO()):
            yield
    finally:
        logger.disabled = before


def is_bus_log(mdf: MDF) -> bool:
    """Whether all a file holds are frames of a bus."""
    groups = [group.channel_group for group in mdf.groups if group.channel_group.cycles_nr]
    return bool(groups) and all(int(getattr(group, "flags", 0)) & BUS_EVENT for group in groups)


def decoded(path: Path, mdf: MDF, dbc: Path) -> MDF:
    """Return the signals of a logged bus, a J1939 one among them, as a file of their own in memory."""
    from asammdf.blocks.utils import load_can_database

    if not any(int(getattr(group.channel_group, "flags", 0)) & BUS_EVENT for group in mdf.groups):
        raise RecordingError(path, "expected the frames of a bus for --dbc, got signals. Leave --dbc out.")
    known: Any = dbc
    database = database_of(path, dbc)
    if dbc.suffix.lower() in DATA_SHEETS:
        known = load_can_database("data_sheet.dbc", contents=database.as_dbc_string().encode())
    signals = mdf.extract_bus_logging({"CAN": [(known, ANY_BUS)]})
    if not any(group.channel_group.cycles_nr for group in signals.groups):
        raise RecordingError(
            path,
            f"--dbc {dbc}: expected a description of the frames in this file, got none of them. Is it of another bus?",
        )
    return signals


@dataclass(frozen=True, slots=True)
class ChannelPlace:
    """Where a channel is in a file."""

    group: int  # its number, from 0
    index: int  # number of the channel in the group, from 0


@dataclass(slots=True)
class Raster:
    """The groups that share one time, and their channels by name."""

    times: Column  # shape (n,), in `unit`
    master: str  # name of the channel of times; "time" where there is none
    unit: str  # of the times; s where the file gives none
    # by the name in the table: one that comes again is numbered
    places: dict[str, ChannelPlace] = field(default_factory=dict)

    @property
    def said(self) -> str:
        """How often it has a sample, for people."""
        if self.times.size < 2:
            return f"with {self.times.size} samples"
        return f"every {float(np.median(np.diff(self.times))):.4g} s"


def foreign_table(path: Path, mdf: MDF, request: Request) -> Table:
    """Read the channels asked for, or those that share the time of most; physical values, invalid ones as NaN."""
    mdf = readable(path, mdf, request)
    rasters, remarks = rasters_of(path, mdf)
    if request.resample_s is not None and (found := _found(rasters, request)):
        return _brought_together(path, mdf, found, request, request.resample_s)
    if not rasters:
        return Table(path, {}, {}, foreign_metadata(mdf))
    chosen = max(rasters, key=lambda raster: _fits(raster, request))
    table = raster_table(path, mdf, chosen)
    elsewhere = {
        name: f"column {name}: it is in this file, but {raster.said}, and what was read is {chosen.said}. "
        "Bring all to one period: [signals] resample_s = 0.01"
        for raster in rasters
        for name in raster.places
        if raster is not chosen
    }
    left = [f"{name}: left out, it has a time of its own" for name in elsewhere]
    return Table(
        path,
        table.columns,
        table.units,
        foreign_metadata(mdf),
        remarks=(*remarks, *table.remarks, *left),
        master=table.master,
        elsewhere=elsewhere,
    )


def foreign_tables(path: Path, mdf: MDF, request: Request) -> list[Table]:
    """Read all channels, a table for each time."""
    mdf = readable(path, mdf, request)
    rasters, _ = rasters_of(path, mdf)
    return [raster_table(path, mdf, raster) for raster in rasters]


def readable(path: Path, mdf: MDF, request: Request) -> MDF:
    """Return a file whose channels are signals: a logged bus decoded."""
    if request.dbc is not None:
        return decoded(path, mdf, request.dbc)
    if is_bus_log(mdf):
        raise RecordingError(
            path, "expected signals, got the frames of a bus as they were logged. Say what they mean: --dbc FILE"
        )
    return mdf


def rasters_of(path: Path, mdf: MDF) -> tuple[list[Raster], list[str]]:
    """Return the times of a file with their channels; a name that comes again is numbered, and that is said."""
    rasters: list[Raster] = []
    count: dict[str, int] = {}
    remarks: list[str] = []
    for group in range(len(mdf.groups)):
        times = np.asarray(mdf.get_master(group))
        if not times.size:
            continue
        raster = next((known for known in rasters if np.array_equal(known.times, times)), None)
        if raster is None:
            rasters.append(raster := Raster(times, *_master(mdf, group)))
        for index, channel in _channels(mdf, group):
            name = str(channel.name)
            count[name] = count.get(name, 0) + 1
            called = name if count[name] == 1 else f"{name} ({count[name]})"
            if called != name:
                remarks.append(f"{name}: another channel has that name, that of group {group + 1} is {called!r} here")
            raster.places[called] = ChannelPlace(group, index)
    require_columns(path, sum(len(raster.places) for raster in rasters))
    return rasters, remarks


def raster_table(path: Path, mdf: MDF, raster: Raster) -> Table:
    """Read all channels of one time, and that."""
    columns: dict[str, Column] = {raster.master: as_column(raster.times)}
    units = {raster.master: raster.unit} if raster.unit else {}
    remarks: list[str] = []
    for name, place in raster.places.items():
        signal = _signal(mdf, place)
        if signal.samples.ndim != 1 or not is_column(signal.samples):
            remarks.append(f"{name}: left out, it is no channel of single numbers or texts")
            continue
        columns[name] = _valid(as_column(signal.samples), signal.invalidation_bits)
        if signal.unit:
            units[name] = str(signal.unit)
    return Table(path, columns, units, remarks=tuple(remarks), master=raster.master)


def foreign_metadata(mdf: MDF) -> dict[str, str]:
    """Read comment, start and common properties of a file."""
    header = mdf.header
    own = {"comment": getattr(header, "description", ""), "start_time": header.start_time.isoformat()}
    properties = getattr(header, "_common_properties", {})
    said = {**own, **{key: value for key, value in properties.items() if isinstance(value, str)}}
    return {key: value for key, value in said.items() if value}


def _channels(mdf: MDF, group: int) -> Iterator[tuple[int, Any]]:
    """Yield the channels of a group with their number, but for its time."""
    master = mdf.masters_db.get(group)
    return ((index, channel) for index, channel in enumerate(channels_of(mdf, group)) if index != master)


def _master(mdf: MDF, group: int) -> tuple[str, str]:
    """Return name and unit of the time of a group."""
    index = mdf.masters_db.get(group)
    if index is None:
        return "time", "s"
    channel = channels_of(mdf, group)[index]
    return str(channel.name), str(getattr(channel, "unit", "") or "s")


def _fits(raster: Raster, request: Request) -> tuple[int, int, int]:
    asked = sum(name in raster.places for name in request.columns)
    return asked, len(raster.places), raster.times.size


def _found(rasters: Sequence[Raster], request: Request) -> dict[str, tuple[Raster, ChannelPlace]]:
    """Return where the channels that are asked for are."""
    places = {name: (raster, place) for raster in rasters for name, place in raster.places.items()}
    return {name: places[name] for name in request.columns if name in places}


def _brought_together(
    path: Path, mdf: MDF, found: dict[str, tuple[Raster, ChannelPlace]], request: Request, period_s: float
) -> Table:
    """Read the channels that are asked for, at one period."""
    series: dict[str, Series] = {}
    units: dict[str, str] = {}
    for name, (raster, place) in found.items():
        signal = _signal(mdf, place)
        column = _valid(as_column(signal.samples), signal.invalidation_bits) if signal.samples.ndim == 1 else None
        if column is None or ColumnKind.of(column) is ColumnKind.TEXT:
            raise RecordingError(path, f"column {name}: expected a channel of numbers for resample_s, got another")
        series[name] = Series(raster.times.astype(np.float64), column.astype(np.float64), name in request.held)
        units[name] = str(signal.unit or "")
    time, columns, remarks = resampled(path, series, period_s)
    master = next(iter(found.values()))[0].master
    units[master] = "s"
    said = {name: unit for name, unit in units.items() if unit}
    return Table(path, {master: time, **columns}, said, foreign_metadata(mdf), remarks=tuple(remarks), master=master)


def _signal(mdf: MDF, place: ChannelPlace) -> Any:
    return mdf.get(group=place.group, index=place.index, ignore_invalidation_bits=True)  # else it drops rows


def _valid(column: Column, invalid: Column | None) -> Column:
    """Mark the samples that the file itself calls invalid as missing."""
    if invalid is None or not np.any(invalid) or ColumnKind.of(column) is ColumnKind.TEXT:
        return column
    return np.where(np.asarray(invalid, dtype=np.bool_), np.nan, column.astype(np.float64))
