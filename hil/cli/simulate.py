"""``hil simulate``: free-run simulation of a recording from its measured torques."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from hil.cli.options import Dbc, Mapped, Signals, TrustFmu, TrustLaws, tell
from hil.cli.printing import say
from hil.errors import UsageError

app = typer.Typer(add_completion=False)


@app.command(epilog="Example: hil simulate --model bus.toml --input run_1.csv --out run_1_simulated.csv")
def simulate(
    model: Annotated[Path, typer.Option(metavar="MODEL", help="Model file, nominal or augmented, or an FMU.")],
    recording: Annotated[Path, typer.Option("--input", metavar="REC", help="Recording with the torques.")],
    out: Annotated[Path, typer.Option(metavar="CSV", help="Simulated output, one row per sample of REC.")],
    dbc: Dbc = None,
    signals: Signals = None,
    mapped: Mapped = None,
    trust_fmu: TrustFmu = False,
    trust_laws: TrustLaws = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
) -> None:
    """Simulate the output from the measured torques, nothing fed back.

    Only what is REC's own is estimated from it: the initial state and the constant load torque; where the model has
    such effects, also phases of angles, moments of events and the profile of the road.
    """
    from estimator.physics.model import unit
    from hil.plants.plant import Trust
    from hil.plants.questioned import GivenInput, simulated_by
    from hil.provenance import provenance
    from hil.recording import Table, csv_format
    from hil.report.numbers import json_number, shown
    from hil.report.wording import output_unit, simulated_column
    from hil.result_folder import publish, require_folder

    if out.suffix.lower() != ".csv":
        raise UsageError(f"--out {out}: expected a name that ends in .csv, got {out.suffix!r}")
    if out.exists() and recording.exists() and out.samefile(recording):
        raise UsageError(f"--out {out}: expected another file than the recording itself. Choose another name.")
    require_folder(out.parent)
    asked = GivenInput(model, signals, mapped or (), Trust(trust_laws, trust_fmu))
    plant, record = simulated_by(asked, recording, dbc, tell)
    run = plant.run(record)
    for sentence in run.beyond:
        tell(sentence)
    column = simulated_column(record.kind, plant.motion)
    further = {f"{each.label}_sim": found for each, found in zip(record.channels, run.further, strict=True)}
    table = Table(out, {"time_s": record.time_s, column: run.output, **further})
    publish(out.parent, {out.name: lambda path: csv_format.write(table, path)})
    error_unit, load_unit = output_unit(record.kind, plant.motion), unit("torque", plant.motion)
    if as_json:
        document = {
            "schema": "hil.simulate/1",
            "recording": record.name,
            "out": str(out),
            "samples": record.time_s.size,
            "rms": {"value": json_number(run.rms), "unit": error_unit},
            "constant_load": {"value": json_number(run.start.load_torque_nm), "unit": load_unit},
            "made": provenance([model], [recording]).document(),
        }
        say(json.dumps(document))
        return
    error, load = shown(run.rms, error_unit), shown(run.start.load_torque_nm, load_unit)
    say(f"{record.name}: {record.time_s.size} samples, RMS error {error}, constant load {load}; in {out}")
