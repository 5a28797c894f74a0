"""``hil replay``: a bus trace through the drivers' decoding, back to the samples of the run."""

from __future__ import annotations

from pathlib import Path

import typer

app = typer.Typer(add_completion=False)


@app.command(epilog="Example: hil replay cruise.blf --rig examples/rig.toml --out again.csv")
def replay(
    trace: Path = typer.Argument(..., metavar="TRACE", help="Bus trace of a run: .blf, .log (candump) or .asc."),
    rig: Path = typer.Option(..., "--rig", metavar="RIG", help="Rig file of the run."),
    out: Path = typer.Option(..., "--out", metavar="REC", help="Recording to write, .csv or .parquet; a new file."),
    every: bool = typer.Option(False, "--all", help="Every cycle from the first SYNC, not only the measured part."),
    as_json: bool = typer.Option(False, "--json", help="Print the result as JSON."),
) -> None:
    """Rebuild a recording from a bus trace; opens no bus.

    Torque and speed are those the run recorded, to the bit. References are what was on the bus: whole per mille of
    the rated torque. The PLC is not on this bus, so no sample is flagged for it.
    """
    import json

    from hil.config.rig_file import read_rig
    from hil.recording import RecordingWriter
    from hil.rig.metadata import run_metadata
    from hil.rig.replay import replay as replayed

    samples = list(replayed(trace, read_rig(rig), whole=every))  # all of them before any is written
    metadata = {**run_metadata(rig, f"replay of {trace.name}"), "replayed_from": trace.name}
    with RecordingWriter(out, metadata) as recorder:
        for sample in samples:
            recorder.append(sample)
    flagged = sum(bool(sample.flags) for sample in samples)
    if as_json:
        typer.echo(
            json.dumps({"schema": "hil.replay/1", "recording": str(out), "recorded": len(samples), "flagged": flagged})
        )
    else:
        typer.echo(f"{out}: {len(samples)} samples, {flagged} flagged")
