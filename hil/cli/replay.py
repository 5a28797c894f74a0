"""``hil replay``: a recording or a bus trace through the on-line chain; a trace back to the samples of the run, too."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from hil.cli.options import FilterOf, FilterRun, TrustLaws, with_filter
from hil.cli.printing import new_console, say
from hil.errors import UsageError

if TYPE_CHECKING:
    from estimator.identification.settings import Settings
    from estimator.signals.record import FloatArray
    from hil.rig.live import OnCourse, Pace
    from hil.rig.live_course import Course

SCHEMA = "hil.replay/1"

app = typer.Typer(add_completion=False)


@app.command(
    epilog="Example: hil replay cruise.csv --speed 10. From a bus trace, and the recording back from it: "
    "hil replay cruise.blf --rig examples/rig.toml --out again.csv"
)
def replay(
    recording: Annotated[
        Path,
        typer.Argument(metavar="REC", help="Recording, or bus trace of a run: .blf, .log (candump), .asc or .trc."),
    ],
    speed: Annotated[
        float | None, typer.Option(metavar="X", help="Multiple of real time; without it as fast as possible.")
    ] = None,
    estimate: Annotated[
        Path | None, typer.Option(metavar="FILE", help="File for the course of the estimate, as JSON.")
    ] = None,
    model: Annotated[
        Path | None, typer.Option(metavar="MODEL", help="Model file: how to read a foreign recording.")
    ] = None,
    sample_time: Annotated[
        float, typer.Option(metavar="SECONDS", help="Sampling period of the models; a multiple of the recording's.")
    ] = 0.02,
    filter_of: FilterOf = None,
    filter_run: FilterRun = None,
    rig: Annotated[Path | None, typer.Option(metavar="RIG", help="Rig file of the run; for a bus trace.")] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="REC", help="Recording to rebuild from a bus trace; a new file.")
    ] = None,
    every: Annotated[
        bool, typer.Option("--all", help="Every cycle of a bus trace from the first SYNC, not only the measured part.")
    ] = False,
    channel: Annotated[
        str | None, typer.Option(metavar="NAME", help="Channel of a bus trace that has several: can0, 1.")
    ] = None,
    trust_laws: TrustLaws = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
) -> None:
    """Play a recording through the on-line chain: the estimates and alarms of the run, to the bit; opens no bus.

    From a bus trace, torque and speed are those the run recorded, to the bit; references are what was on the bus:
    whole per mille of the rated torque. The PLC is not on this bus, so no sample is flagged for it.
    """
    from hil.result_folder import publish
    from hil.rig.live import Pace, tracking_settings
    from hil.rig.trace import is_trace
    from hil.store.entry import statements

    if speed is not None and not speed > 0:
        raise UsageError(f"--speed: expected a multiple of real time above 0, got {speed:g}")
    settings, pace = tracking_settings(sample_time), Pace(speed)
    settings, filter_l = with_filter(settings, filter_of, filter_run)
    begun_s = time.perf_counter()
    if is_trace(recording):
        _require(recording, "a bus trace", {"--rig": rig}, {"--model": model})
        course, result = _play_trace(recording, rig or Path(), out, every, channel, settings, pace, filter_l)
    else:
        _require(
            recording, "a recording", {}, {"--rig": rig, "--out": out, "--all": every or None, "--channel": channel}
        )
        course, result = _play_recording(recording, model, trust_laws, settings, pace, filter_l)
    took_s = time.perf_counter() - begun_s
    if estimate is not None:
        publish(estimate.absolute().parent, {estimate.name: course.write})
    if as_json:
        rate = course.samples / took_s
        say(json.dumps({"schema": SCHEMA, **result, "samples_per_s": rate, "online": course.summary()}))
        return
    if out is not None:
        say(f"{out}: {result['recorded']} samples, {result['flagged']} flagged")
    say(f"{recording}: {course.samples} samples in {took_s:.2f} s; {course.statement}")
    if course.excitation:
        say(f"  {course.excitation}")
    for statement in statements(course.summary()):
        say(f"  alarm: {statement}")


def _require(path: Path, what: str, needed: dict[str, object], senseless: dict[str, object]) -> None:
    for option, value in needed.items():
        if value is None:
            raise UsageError(f"{path}: expected {option} with {what}, got none")
    for option, value in senseless.items():
        if value is not None:
            hint = " To rewrite a recording: hil convert." if option == "--out" else ""
            raise UsageError(f"{path}: expected no {option} with {what}, got one.{hint}")


def _play_recording(
    path: Path, model: Path | None, trust_laws: bool, settings: Settings, pace: Pace, filter_l: FloatArray | None
) -> tuple[Course, dict[str, Any]]:
    from hil.config.model_file import read_model_for_recordings
    from hil.recording import read_record
    from hil.rig.live import play_record

    signals = None if model is None else read_model_for_recordings(model, trust_laws).signals
    record = read_record(path, signals)
    course = play_record(record, settings, pace, _show(pace), filter_l)
    flagged = int((~record.okay).sum())
    return course, {"recording": str(path), "recorded": course.samples, "flagged": flagged}


def _play_trace(
    path: Path,
    rig_path: Path,
    out: Path | None,
    every: bool,
    channel: str | None,
    settings: Settings,
    pace: Pace,
    filter_l: FloatArray | None,
) -> tuple[Course, dict[str, Any]]:
    from hil.config.rig_file import read_rig
    from hil.recording import RecordingWriter
    from hil.rig.live import play_samples
    from hil.rig.metadata import replay_metadata
    from hil.rig.replay import replay as replayed

    rig = read_rig(rig_path)
    samples = list(replayed(path, rig, whole=every, channel=channel))  # all of them before any is written
    course = play_samples(samples, rig.period_s, settings, pace, _show(pace), filter_l)
    if out is not None:
        said = replay_metadata(rig_path, path, samples[0].t_ns)
        with RecordingWriter(out, said, channel_units=rig.channel_units) as recorder:
            for sample in samples:
                recorder.append(sample)
    flagged = sum(bool(sample.flags) for sample in samples)
    return course, {"recording": None if out is None else str(out), "recorded": len(samples), "flagged": flagged}


def _show(pace: Pace) -> OnCourse:
    """Return what shows the estimate as it goes: on a terminal, where the eye can follow."""
    console = new_console(stderr=True)
    if pace.speed is None or not console.is_terminal:
        return lambda course, time_s: None
    return lambda course, time_s: console.print(f"{time_s:8.1f} s  {course.statement}", end="\r", highlight=False)
