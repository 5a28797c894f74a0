"""Files as other programs write them, all of one drive: two torques and a speed, 500 rows at 10 ms."""

from __future__ import annotations

import json
import struct
import zipfile
from collections.abc import Callable
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pytest

N, PERIOD_S = 500, 0.01
TIME = np.arange(N) * PERIOD_S
_RANDOM = np.random.default_rng(7)
TORQUE_M1 = np.repeat(_RANDOM.choice([-40.0, 40.0], N // 5), 5) + 20.0
TORQUE_M2 = np.round(0.5 * TORQUE_M1 + 3.0 * np.sin(TIME), 3)
SPEED = np.round(60.0 + np.cumsum(TORQUE_M1 + TORQUE_M2 - 30.0) * PERIOD_S / 100.0, 4)
RPM = SPEED * 60.0 / (2.0 * np.pi)
START = datetime(2026, 3, 5, 14, 7, 31)

Maker = Callable[[Path], Path]
MAKERS: dict[str, Maker] = {}


def maker(function: Maker) -> Maker:
    MAKERS[function.__name__] = function
    return function


def _frame(time: str | None = "t", speed: str = "n [1/min]", torque: str = "T{} [Nm]") -> pd.DataFrame:
    columns = {} if time is None else {time: TIME}
    return pd.DataFrame({**columns, torque.format(1): TORQUE_M1, torque.format(2): TORQUE_M2, speed: RPM})


def _text(path: Path, lines: list[str], encoding: str = "utf-8") -> Path:
    path.write_text("\n".join(lines) + "\n", encoding=encoding)
    return path


def _rows(stamp: Callable[[int], str], between: str = ",", decimal: str = ".") -> list[str]:
    def number(value: float) -> str:
        return f"{value:.6f}".replace(".", decimal)

    return [between.join([stamp(k), *map(number, (TORQUE_M1[k], TORQUE_M2[k], RPM[k]))]) for k in range(N)]


def _moment(k: int) -> datetime:
    return START + timedelta(seconds=k * PERIOD_S)


# --- text


@maker
def pandas_with_its_index(folder: Path) -> Path:
    _frame().to_csv(folder / "a.csv")
    return folder / "a.csv"


@maker
def pandas_with_moments_as_index(folder: Path) -> Path:
    frame = _frame(None)
    frame.index = pd.DatetimeIndex([_moment(k) for k in range(N)])
    frame.to_csv(folder / "a.csv")
    return folder / "a.csv"


@maker
def pandas_with_durations_as_index(folder: Path) -> Path:
    frame = _frame(None)
    frame.index = pd.to_timedelta(TIME, unit="s")
    frame.to_csv(folder / "a.csv")
    return folder / "a.csv"


@maker
def excel_german(folder: Path) -> Path:
    head = ["Zeit [s];Drehmoment 1 [Nm];Drehmoment 2 [Nm];Drehzahl [1/min]"]
    return _text(folder / "a.csv", head + _rows(lambda k: f"{TIME[k]:.2f}".replace(".", ","), ";", ","), "latin-1")


@maker
def german_dates(folder: Path) -> Path:
    head = ["Zeit;T1 [Nm];T2 [Nm];n [1/min]"]

    def stamp(k: int) -> str:
        return f"{_moment(k):%d.%m.%Y %H:%M:%S},{_moment(k).microsecond // 1000:03d}"

    return _text(folder / "a.csv", head + _rows(stamp, ";", ","))


@maker
def american_dates(folder: Path) -> Path:
    def stamp(k: int) -> str:
        return f"{_moment(k):%m/%d/%Y %I:%M:%S}.{_moment(k).microsecond // 1000:03d} PM"

    return _text(folder / "a.csv", ["Timestamp,Torque1 (Nm),Torque2 (Nm),Speed (rpm)", *_rows(stamp)])


@maker
def times_of_day(folder: Path) -> Path:
    def stamp(k: int) -> str:
        return f"{_moment(k):%H:%M:%S}.{_moment(k).microsecond // 1000:03d}"

    return _text(folder / "a.csv", ["Clock,Torque1 (Nm),Torque2 (Nm),Speed (rpm)", *_rows(stamp)])


@maker
def days_of_a_spreadsheet(folder: Path) -> Path:
    days = (START - datetime(1899, 12, 30)) / timedelta(days=1)
    return _text(
        folder / "a.csv",
        ["when,torque_1_nm,torque_2_nm,speed_rpm", *_rows(lambda k: f"{days + TIME[k] / 86400.0:.11f}")],
    )


@maker
def milliseconds(folder: Path) -> Path:
    return _text(folder / "a.csv", ["t_ms,T1_Nm,T2_Nm,n_rpm", *_rows(lambda k: f"{10 * k}")])


@maker
def epoch_milliseconds(folder: Path) -> Path:
    return _text(
        folder / "a.csv",
        ["timestamp,torque1 [Nm],torque2 [Nm],speed [rpm]", *_rows(lambda k: f"{1772719651000 + 10 * k}")],
    )


@maker
def grafana(folder: Path) -> Path:
    head = ['"Time","torque 1 (Nm)","torque 2 (Nm)","speed (rpm)"']
    return _text(folder / "a.csv", head + _rows(lambda k: f"{_moment(k):%Y-%m-%d %H:%M:%S}.{k % 100:02d}0"))


@maker
def superscripts(folder: Path) -> Path:
    return _text(folder / "a.csv", ["t / s,T1 / N·m,T2 / N·m,n / min⁻¹", *_rows(lambda k: f"{TIME[k]:.2f}")])


@maker
def a_row_of_units(folder: Path) -> Path:
    return _text(folder / "a.csv", ["time,T1,T2,n", "s,Nm,Nm,1/min", *_rows(lambda k: f"{TIME[k]:.2f}")])


@maker
def units_above_the_names(folder: Path) -> Path:
    return _text(folder / "a.csv", ["s,Nm,Nm,rpm", "time,T1,T2,n", *_rows(lambda k: f"{TIME[k]:.2f}")])


@maker
def matlab_timetable_as_text(folder: Path) -> Path:
    return _text(folder / "a.csv", ["Time,T1_Nm,T2_Nm,n_rpm", *_rows(lambda k: f"{TIME[k]:g} sec")])


@maker
def a_time_of_no_known_name(folder: Path) -> Path:
    return _text(folder / "a.csv", ["__x,T1_Nm,T2_Nm,n_rpm", *_rows(lambda k: f"{TIME[k]:.2f}")])


@maker
def numpy_savetxt(folder: Path) -> Path:
    np.savetxt(folder / "a.txt", np.column_stack([TIME, TORQUE_M1, TORQUE_M2, RPM]), header="t T1_Nm T2_Nm n_rpm")
    return folder / "a.txt"


@maker
def tabs(folder: Path) -> Path:
    return _text(folder / "a.tsv", ["time\tT1 [Nm]\tT2 [Nm]\tn [rpm]", *_rows(lambda k: f"{TIME[k]:.2f}", "\t")])


@maker
def inca_ascii(folder: Path) -> Path:
    head = [
        "ETASAsciiItemFile\trecord\tdelimiter\t1\tdecimalSeparator\t.",
        "sampleCount\t500",
        "time\tT1\tT2\tn",
        "f8\tf8\tf8\tf8",
        "s\tNm\tNm\t1/min",
    ]
    return _text(folder / "a.ascii", head + _rows(lambda k: f"{TIME[k]:.2f}", "\t"))


@maker
def labview_measurement(folder: Path) -> Path:
    head = [
        "LabVIEW Measurement\t",
        "Writer_Version\t2",
        "Reader_Version\t2",
        "Separator\tTab",
        "Decimal_Separator\t.",
        "Multi_Headings\tNo",
        "X_Columns\tOne",
        "Time_Pref\tRelative",
        "Operator\tme",
        "Date\t2026/03/05",
        "Time\t14:07:31.0000000000000000000",
        "***End_of_Header***\t",
        "",
        "Channels\t3\t\t\t\t",
        "Samples\t500\t500\t500\t",
        "Date\t2026/03/05\t2026/03/05\t2026/03/05\t",
        "Time\t14:07:31\t14:07:31\t14:07:31\t",
        "Y_Unit_Label\tNm\tNm\trpm\t",
        "X_Dimension\tTime\tTime\tTime\t",
        "X0\t0.0\t0.0\t0.0\t",
        "Delta_X\t0.010000\t0.010000\t0.010000\t",
        "***End_of_Header***\t\t\t\t",
        "X_Value\tT1\tT2\tn\tComment",
    ]
    return _text(folder / "a.lvm", head + _rows(lambda k: f"{TIME[k]:.6f}", "\t"))


@maker
def tektronix(folder: Path) -> Path:
    head = [
        "Model,MSO44",
        "Firmware Version,1.40",
        "",
        "Waveform Type,ANALOG",
        "Point Format,Y",
        "Horizontal Units,s",
        "Horizontal Scale,0.5",
        "Sample Interval,0.01",
        "Record Length,500",
        "Vertical Units,Nm,Nm,rpm",
        "Label,T1,T2,n",
        "TIME,CH1 T1 [Nm],CH2 T2 [Nm],CH3 n [rpm]",
    ]
    return _text(folder / "a.csv", head + _rows(lambda k: f"{TIME[k]:.6e}"))


@maker
def keysight(folder: Path) -> Path:
    return _text(folder / "a.csv", ["x-axis,1,2,3", "second,Nm,Nm,rpm", *_rows(lambda k: f"{TIME[k]:.6E}")])


@maker
def lecroy(folder: Path) -> Path:
    head = [
        "LECROYWR610Zi,12345,Waveform",
        "Segments,1,SegmentSize,500",
        "Segment,TrigTime,TimeSinceSegment1",
        "#1,05-Mar-2026 14:07:31,0",
        "Time,T1_Nm,T2_Nm,n_rpm",
    ]
    return _text(folder / "a.csv", head + _rows(lambda k: f"{TIME[k]:.9f}"))


@maker
def twincat_scope(folder: Path) -> Path:
    head = [
        "Name\tAxis 1",
        "File\tscope.svdx",
        "Starttime of export\t133000000000000000",
        "",
        "Name\tT1\tT2\tn",
        "Unit\tNm\tNm\t1/min",
        "",
    ]
    return _text(folder / "a.csv", head + _rows(lambda k: f"{10 * k}", "\t"))


@maker
def influx_annotated(folder: Path) -> Path:
    lines = [
        "#group,false,false,false,false,true",
        "#datatype,string,long,dateTime:RFC3339,double,string",
        "#default,_result,,,,",
        ",result,table,_time,_value,_field",
    ]
    for number, (name, values) in enumerate({"T1_Nm": TORQUE_M1, "T2_Nm": TORQUE_M2, "n_rpm": RPM}.items()):
        lines += [f",,{number},{_moment(k):%Y-%m-%dT%H:%M:%S}.{k % 100:02d}Z,{values[k]:.6f},{name}" for k in range(N)]
    return _text(folder / "a.csv", lines)


@maker
def lines_of_json(folder: Path) -> Path:
    _frame("t", "n_rpm", "T{}_Nm").to_json(folder / "a.jsonl", orient="records", lines=True)
    return folder / "a.jsonl"


# --- tables and arrays


@maker
def parquet_with_moments_as_index(folder: Path) -> Path:
    frame = _frame(None, "n_rpm", "T{}_Nm")
    frame.index = pd.DatetimeIndex([_moment(k) for k in range(N)], name="time")
    frame.to_parquet(folder / "a.parquet")
    return folder / "a.parquet"


@maker
def parquet_with_units_in_names(folder: Path) -> Path:
    _frame().to_parquet(folder / "a.parquet")
    return folder / "a.parquet"


@maker
def feather(folder: Path) -> Path:
    _frame("time", "n_rpm", "T{}_Nm").to_feather(folder / "a.feather")
    return folder / "a.feather"


@maker
def excel(folder: Path) -> Path:
    pytest.importorskip("openpyxl")
    _frame().to_excel(folder / "a.xlsx", index=False)
    return folder / "a.xlsx"


@maker
def excel_with_moments(folder: Path) -> Path:
    pytest.importorskip("openpyxl")
    frame = _frame(None)
    frame.insert(0, "when", [_moment(k) for k in range(N)])
    frame.to_excel(folder / "a.xlsx", index=False)
    return folder / "a.xlsx"


@maker
def open_document(folder: Path) -> Path:
    """As LibreOffice stores it: numbers as such, empty cells and rows counted to the end of the sheet."""
    names = "urn:oasis:names:tc:opendocument:xmlns:"
    frame = _frame()
    head = "".join(f"<table:table-cell><text:p>{name}</text:p></table:table-cell>" for name in frame)
    rows = "".join(
        "<table:table-row>"
        + "".join(
            f'<table:table-cell office:value="{value!r}"><text:p>{value:.2f}</text:p></table:table-cell>'
            for value in row
        )
        + '<table:table-cell table:number-columns-repeated="16380"/></table:table-row>'
        for row in frame.to_numpy().tolist()
    )
    empty = '<table:table-row table:number-rows-repeated="1048000"><table:table-cell/></table:table-row>'
    spaces = " ".join(f'xmlns:{each}="{names}{each}:1.0"' for each in ("table", "office", "text"))
    with zipfile.ZipFile(folder / "a.ods", "w", zipfile.ZIP_DEFLATED) as book:
        book.writestr(
            "content.xml",
            f'<office:body {spaces}><table:table table:name="Sheet1"><table:table-row>{head}</table:table-row>'
            f"{rows}{empty}</table:table></office:body>",
        )
    return folder / "a.ods"


@maker
def arrow_stream(folder: Path) -> Path:
    table = pa.Table.from_pandas(_frame("time", "n_rpm", "T{}_Nm"))
    with pa.ipc.new_stream(folder / "a.arrow", table.schema) as stream:
        stream.write_table(table)
    return folder / "a.arrow"


@maker
def packed_text(folder: Path) -> Path:
    _frame().to_csv(folder / "a.csv.gz", index=False)
    return folder / "a.csv.gz"


@maker
def grouped_digits(folder: Path) -> Path:
    """As a spreadsheet shows numbers of a thousand and more, between quotes."""
    rows = [
        f'{t:.2f},{a},{b},"{1e3 * n:,.4f}"' for t, a, b, n in zip(TIME, TORQUE_M1, TORQUE_M2, RPM / 1e3, strict=True)
    ]
    return _text(folder / "a.csv", ["t,T1 [Nm],T2 [Nm],n [1/min]", *rows])


def wpilib_data_log(path: Path, entries: dict[str, tuple[str, list[bytes]]], us: list[int]) -> Path:
    """Write a data log of version 1.0, all entries at the same moments."""

    def record(entry: int, stamp: int, value: bytes) -> bytes:
        return bytes([0b0111_1101]) + struct.pack("<HIQ", entry, len(value), stamp) + value

    def text(of: str) -> bytes:
        return struct.pack("<I", len(of)) + of.encode()

    content = b"WPILOG" + struct.pack("<HI", 0x0100, 5) + b"extra"
    for number, (name, (kind, _)) in enumerate(entries.items(), start=1):
        content += record(0, us[0], b"\0" + struct.pack("<I", number) + text(name) + text(kind) + text(""))
    for k, stamp in enumerate(us):
        content += b"".join(record(number, stamp, values[k]) for number, (_, values) in enumerate(entries.values(), 1))
    path.write_bytes(content)
    return path


@maker
def wpilog(folder: Path) -> Path:
    columns = {"/T1_Nm": TORQUE_M1, "/T2_Nm": TORQUE_M2, "/n_rpm": RPM}
    entries = {name: ("double", [struct.pack("<d", value) for value in of]) for name, of in columns.items()}
    return wpilib_data_log(folder / "a.wpilog", entries, [4_000_000 + 10_000 * k for k in range(N)])


@maker
def numpy_archive(folder: Path) -> Path:
    np.savez(folder / "a.npz", t=TIME, T1_Nm=TORQUE_M1, T2_Nm=TORQUE_M2, n_rpm=RPM)
    return folder / "a.npz"


@maker
def numpy_structured(folder: Path) -> Path:
    np.save(folder / "a.npy", _frame("t", "n_rpm", "T{}_Nm").to_records(index=False))
    return folder / "a.npy"


@maker
def pandas_hdf5_fixed(folder: Path) -> Path:
    pytest.importorskip("tables")
    _frame("t", "n_rpm", "T{}_Nm").to_hdf(folder / "a.h5", key="run", format="fixed")
    return folder / "a.h5"


@maker
def pandas_hdf5_table(folder: Path) -> Path:
    pytest.importorskip("tables")
    _frame("t", "n_rpm", "T{}_Nm").to_hdf(folder / "a.h5", key="run", format="table")
    return folder / "a.h5"


@maker
def hdf5_arrays(folder: Path) -> Path:
    import h5py

    with h5py.File(folder / "a.h5", "w") as file:
        for name, values in {"t": TIME, "T1_Nm": TORQUE_M1, "T2_Nm": TORQUE_M2, "n_rpm": RPM}.items():
            file[f"run/{name}"] = values
    return folder / "a.h5"


@maker
def hdf5_of_one_matrix(folder: Path) -> Path:
    import h5py

    with h5py.File(folder / "a.h5", "w") as file:
        for name, values in {"time": TIME, "torque_1_nm": TORQUE_M1, "torque_2_nm": TORQUE_M2, "speed": RPM}.items():
            file[name] = values
            file[name].attrs["units"] = "1/min" if name == "speed" else ""
    return folder / "a.h5"


# --- MATLAB and Simulink


@maker
def matlab_vectors(folder: Path) -> Path:
    import scipy.io

    scipy.io.savemat(folder / "a.mat", {"t": TIME, "T1_Nm": TORQUE_M1, "T2_Nm": TORQUE_M2, "n_rpm": RPM})
    return folder / "a.mat"


@maker
def simulink_to_workspace(folder: Path) -> Path:
    import scipy.io

    signals = {"values": np.column_stack([TORQUE_M1, TORQUE_M2]), "dimensions": 2.0, "label": "torque"}
    speed = {"values": RPM, "dimensions": 1.0, "label": "n_rpm"}
    scipy.io.savemat(
        folder / "a.mat",
        {"torque": {"time": TIME, "signals": signals}, "n_rpm": {"time": TIME, "signals": speed}},
    )
    return folder / "a.mat"


# --- measurement files


@maker
def mdf4(folder: Path) -> Path:
    from asammdf import MDF, Signal

    with MDF() as mdf:
        named = {"T1": (TORQUE_M1, "Nm"), "T2": (TORQUE_M2, "Nm"), "n": (RPM, "1/min")}
        mdf.append([Signal(values, TIME, name=name, unit=unit) for name, (values, unit) in named.items()])
        mdf.save(folder / "a.mf4")
    return folder / "a.mf4"


@maker
def mdf4_without_units(folder: Path) -> Path:
    from asammdf import MDF, Signal

    with MDF() as mdf:
        named = {"T1_Nm": TORQUE_M1, "T2_Nm": TORQUE_M2, "n_rpm": RPM}
        mdf.append([Signal(values, TIME, name=name) for name, values in named.items()])
        mdf.save(folder / "a.mf4")
    return folder / "a.mf4"


@maker
def tdms(folder: Path) -> Path:
    nptdms = pytest.importorskip("nptdms")
    named = {"T1": (TORQUE_M1, "Nm"), "T2": (TORQUE_M2, "Nm"), "n": (RPM, "rpm")}
    properties = {"wf_increment": PERIOD_S, "wf_start_offset": 0.0}
    with nptdms.TdmsWriter(str(folder / "a.tdms")) as writer:
        writer.write_segment(
            [
                nptdms.ChannelObject("run", name, values, {**properties, "unit_string": unit})
                for name, (values, unit) in named.items()
            ]
        )
    return folder / "a.tdms"


@maker
def mcap(folder: Path) -> Path:
    writing = pytest.importorskip("mcap.writer")
    with (folder / "a.mcap").open("wb") as file:
        writer = writing.Writer(file)
        writer.start()
        schema = writer.register_schema("drive", "jsonschema", b'{"type": "object"}')
        channel = writer.register_channel("/drive", "json", schema)
        for k in range(N):
            stamp = int(1772719651_000_000_000 + k * 10_000_000)
            message = {"T1_Nm": TORQUE_M1[k], "T2_Nm": TORQUE_M2[k], "n_rpm": RPM[k]}
            writer.add_message(channel, stamp, json.dumps(message).encode(), stamp)
        writer.finish()
    return folder / "a.mcap"


# --- bus logs

DBC = """VERSION ""
NS_ :
BS_:
BU_: host m1
BO_ 385 TPDO_m1: 8 m1
 SG_ T1 : 0|16@1- (0.01,0) [-327|327] "Nm" host
 SG_ T2 : 16|16@1- (0.01,0) [-327|327] "Nm" host
 SG_ n : 32|32@1- (0.001,0) [-1E6|1E6] "1/min" host
"""


def dbc_of(folder: Path) -> Path:
    (folder / "drive.dbc").write_text(DBC)
    return folder / "drive.dbc"


def _bus_log(path: Path) -> Path:
    import can
    import cantools

    message = cantools.database.load_string(DBC, "dbc").messages[0]
    with can.Logger(str(path)) as log:
        for k in range(N):
            stamp = 1772719651.0 + TIME[k]
            data = message.encode({"T1": TORQUE_M1[k], "T2": TORQUE_M2[k], "n": RPM[k]}, strict=False)
            log(can.Message(stamp, 128, is_extended_id=False, channel=0, data=b""))
            log(can.Message(stamp, 385, is_extended_id=False, channel=0, data=data))
    return path


BUS_LOGS: dict[str, Maker] = {
    suffix: lambda folder, suffix=suffix: _bus_log(folder / f"a{suffix}") for suffix in (".blf", ".asc", ".log", ".trc")
}
