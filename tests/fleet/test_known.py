"""Recordings are found by their names, whatever is in them, and known again by what changes with them."""

import os
import zipfile
from pathlib import Path

import pytest

from hil.fleet.known import Survey, stamp
from hil.fleet.run import Fleet
from hil.fleet.sources import FleetRecording, Seen, at_hand, find, in_order, seen

ROWS = "time_s,torque_m1_nm,torque_m2_nm,speed_rad_s\n0,1,1,1\n0.01,1,1,1\n"


@pytest.mark.parametrize("name", ["a[1].csv", "b*.csv", "c?.csv", "d::e.csv"])
def test_a_name_is_a_name_whatever_is_in_it(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text(ROWS)
    (tmp_path / "a1.csv").write_text(ROWS)
    for source in (tmp_path / name, tmp_path):
        found, complaints = find([str(source)], None)
        assert str(tmp_path / name) in [each.url for each in found]
        assert complaints == []
    assert seen(str(tmp_path / name)).sha256
    assert len(find([f"{tmp_path}/?1.csv"], None)[0]) == 1


@pytest.mark.parametrize("chain", ["zip://*.csv::file://", "zip://a.csv::file://", "zip::file://"])
def test_what_is_in_an_archive_is_listed_so_that_it_can_be_fetched(tmp_path: Path, chain: str) -> None:
    with zipfile.ZipFile(tmp_path / "x.zip", "w") as archive:
        archive.writestr("a.csv", ROWS)
    (found,), complaints = find([f"{chain}{tmp_path}/x.zip"], None)
    assert complaints == []
    with at_hand(found.url) as path:
        assert path.read_text() == ROWS
    first = stamp(found.url)
    assert first == stamp(found.url)


def test_what_has_not_changed_is_known_and_what_has_is_read(tmp_path: Path) -> None:
    path, side = tmp_path / "a.csv", tmp_path / "a.csv.json"
    path.write_text(ROWS)
    stamps = [stamp(str(path))]
    os.utime(path, ns=(0, 1))
    stamps.append(stamp(str(path)))
    path.write_text(ROWS.replace("0.01", "0.02"))
    os.utime(path, ns=(0, 1))  # size and time alone would not tell
    stamps.append(stamp(str(path)))
    side.write_text("{}")
    stamps.append(stamp(str(path)))
    assert "" not in stamps
    assert len(set(stamps)) == 4
    os.mkfifo(tmp_path / "pipe.csv")
    assert stamp(str(tmp_path / "pipe.csv")) == ""
    survey = Survey([])
    survey.note("a", stamps[0], Seen("1", "bus", "rig", "2026"))
    again = Survey(survey.rows())
    assert again.seen("a", stamps[0]) == Seen("1", "bus", "rig", "2026")
    assert again.seen("a", stamps[1]) is again.seen("b", stamps[0]) is again.seen("a", "") is None


def test_vehicles_come_as_people_count() -> None:
    names = ["bus_10", "bus_2", "bus_02b", "bus_1", "", "9" * 5000]
    assert sorted(names, key=in_order) == ["", "9" * 5000, "bus_1", "bus_2", "bus_02b", "bus_10"]
    fleet = Fleet([FleetRecording("x", "bus_10", sha256="1"), FleetRecording("y", "bus_9", sha256="2")])
    assert [piece[0].vehicle for piece in fleet.pieces(by_vehicle=True)] == ["bus_9", "bus_10"]
