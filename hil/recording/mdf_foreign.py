"""MDF files of other programs: which of their many groups is the recording.

A file of a measurement tool has a group for each rate. The groups that share their time to the bit belong together; of
those the ones with the most channels are the recording, the others are left out, by name. Nothing is interpolated: a
sample that was made up is none.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hil.recording.kinds import Column, Kind, as_column, is_column
from hil.recording.mdf_file import channels_of
from hil.recording.table import Table

if TYPE_CHECKING:
    from asammdf import MDF


@dataclass(slots=True)
class _Raster:
    """The groups that share one time."""

    times: Column
    groups: list[int] = field(default_factory=list)
    n_channels: int = 0


def foreign_table(path: Path, mdf: MDF) -> Table:
    """Read the channels that share the time of most of them; physical values, invalid ones as NaN."""
    rasters = sorted(_rasters(mdf), key=lambda raster: (raster.n_channels, raster.times.size), reverse=True)
    columns: dict[str, Column] = {}
    units: dict[str, str] = {}
    remarks: list[str] = []
    for number in rasters[0].groups if rasters else ():
        _take(mdf, number, columns, units, remarks)
    for raster in rasters[1:]:
        remarks += [f"{name}: left out, it has a time of its own" for name in _names(mdf, raster.groups)]
    return Table(path, columns, units, foreign_metadata(mdf), remarks=tuple(remarks))


def foreign_metadata(mdf: MDF) -> dict[str, str]:
    """Read comment, start and common properties of a file."""
    header = mdf.header
    own = {"comment": getattr(header, "description", ""), "start_time": header.start_time.isoformat()}
    properties = getattr(header, "_common_properties", {})
    said = {**own, **{key: value for key, value in properties.items() if isinstance(value, str)}}
    return {key: value for key, value in said.items() if value}


def _rasters(mdf: MDF) -> list[_Raster]:
    rasters: list[_Raster] = []
    for number in range(len(mdf.groups)):
        times = np.asarray(mdf.get_master(number))
        if not times.size:
            continue
        same = next((raster for raster in rasters if np.array_equal(raster.times, times)), None)
        if same is None:
            rasters.append(same := _Raster(times))
        same.groups.append(number)
        same.n_channels += len(channels_of(mdf, number))
    return rasters


def _take(mdf: MDF, number: int, columns: dict[str, Column], units: dict[str, str], remarks: list[str]) -> None:
    """Add the channels of one group; the time of the first is that of all."""
    master = mdf.masters_db.get(number)
    for index, channel in enumerate(channels_of(mdf, number)):
        name = str(channel.name)
        if index == master and columns:
            continue
        if name in columns:
            remarks.append(f"{name}: left out, another channel has that name")
            continue
        signal = mdf.get(group=number, index=index, ignore_invalidation_bits=True)  # else it drops rows
        if signal.samples.ndim != 1 or not is_column(signal.samples):
            remarks.append(f"{name}: left out, it is no channel of single numbers or texts")
            continue
        columns[name] = _valid(as_column(signal.samples), signal.invalidation_bits)
        if signal.unit:
            units[name] = str(signal.unit)


def _valid(column: Column, invalid: Column | None) -> Column:
    """Mark the samples that the file itself calls invalid as missing."""
    if invalid is None or not np.any(invalid) or Kind.of(column) is Kind.TEXT:
        return column
    return np.where(np.asarray(invalid, dtype=np.bool_), np.nan, column.astype(np.float64))


def _names(mdf: MDF, groups: Sequence[int]) -> list[str]:
    return [
        str(channel.name)
        for number in groups
        for index, channel in enumerate(channels_of(mdf, number))
        if index != mdf.masters_db.get(number)
    ]
