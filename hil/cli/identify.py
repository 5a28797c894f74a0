"""``hil identify``: off line, the same recursive estimator, the output-error model, the spectral estimate."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

if TYPE_CHECKING:
    from rich.table import Table

    from estimator.identification.identify import Identification, Settings
    from estimator.identification.linear_model import ComplexArray, LinearModel
    from estimator.identification.modes.modes import Mode
    from estimator.identification.spectral.welch import SpectralEstimate
    from estimator.physics.model import DrivelineModel
    from estimator.signals.record import Record

SCHEMA = "hil.identification/1"
FILE_NAME = "identification.json"

app = typer.Typer(add_completion=False)


@app.command(epilog="Example: hil identify run_1.csv run_2.csv --out identified --model bus.toml")
def identify(
    recordings: list[Path] = typer.Argument(..., metavar="REC...", help="Recordings to identify from."),
    out: Path = typer.Option(..., "--out", metavar="DIR", help=f"Folder for {FILE_NAME}; made where missing."),
    model: Path | None = typer.Option(
        None,
        "--model",
        metavar="MODEL",
        help="Model file: how to read foreign recordings, and what to compare with.",
    ),
    samples: int = typer.Option(
        1024, "--samples", metavar="N", help="Good samples the on-line estimate is run through; 0 for all."
    ),
    sample_time: float = typer.Option(
        0.02,
        "--sample-time",
        metavar="SECONDS",
        help="Sampling period of the models; a multiple of the recording's.",
    ),
    as_json: bool = typer.Option(False, "--json", help=f"Print {FILE_NAME} instead of the table."),
) -> None:
    """Identify the driveline from each recording: models, resonance, damping.

    Writes DIR/identification.json with theta, A, B, poles, zeros and the spectral estimate of each recording.
    """
    from rich.console import Console

    from estimator.identification.identify import Settings
    from hil.config.model_file import read_model_for_recordings
    from hil.errors import ModelFileError
    from hil.recording import read_records
    from hil.recording.timing_check import require_even_cycles
    from hil.report.outputs import publish, require_folder

    require_folder(out)
    require_even_cycles(recordings)
    settings = Settings(sample_time_s=sample_time, samples=samples or None)
    file = None if model is None else read_model_for_recordings(model)
    if model is not None and file is not None and file.on_bench:
        raise ModelFileError(
            model, "structure | expected a driveline, which torque moves | came 'joint': diagnose or simulate it"
        )
    records = read_records(recordings, None if file is None else file.signals)
    results = _identified(records, settings)
    nominal = None if file is None else nominal_resonance(file.model)
    text = identification_text(results, settings, nominal)
    publish(out, {FILE_NAME: lambda path: path.write_text(text, encoding="utf-8")})
    if as_json:
        typer.echo(text, nl=False)
    else:
        Console().print(summary(results, nominal))
        typer.echo(f"all of it: {out / FILE_NAME}")


def _identified(records: Sequence[Record], settings: Settings) -> list[Identification]:
    """Identify from each, with a bar on standard error where that is a terminal."""
    from rich.console import Console
    from rich.progress import track

    from estimator.identification.identify import identify as identify_record

    console = Console(stderr=True)
    bar = track(records, "identifying", console=console, transient=True, disable=not console.is_terminal)
    return [identify_record(record, settings) for record in bar]


def nominal_resonance(model: DrivelineModel) -> Mode | None:
    """Return the mode a nominal model expects; None for a structure that does not oscillate."""
    from estimator.identification.modes.modes import two_mass_resonance
    from estimator.physics.model import Structure

    return two_mass_resonance(**model.values()) if model.structure is Structure.TWO_MASS else None


def identification_text(results: Iterable[Identification], settings: Settings, nominal: Mode | None) -> str:
    """Return the text of identification.json.

    Coefficients are written with all their digits, so that a model read back is the same to the bit.
    """
    document = {
        "schema": SCHEMA,
        "settings": {
            "na": settings.orders.na,
            "nb": settings.orders.nb,
            "nk": settings.orders.nk,
            "sample_time_s": settings.sample_time_s,
            "high_pass_hz": settings.high_pass_hz,
            "samples": settings.samples,
            "filter_part": settings.filter_part.value,
            "band_hz": list(settings.band_hz),
        },
        "nominal_resonance": _mode(nominal),
        "recordings": [_recording(result) for result in results],
    }
    return json.dumps(document, indent=1, allow_nan=False) + "\n"


def _recording(result: Identification) -> dict[str, Any]:
    estimate, batch = result.estimate, result.batch
    online = _model(result.online, result.online_resonance) | {
        "status": estimate.status.value,
        "reason": estimate.reason.message,
        "samples_used": int(result.trajectory.used.sum()),
    }
    offline = _model(batch.model, result.batch_resonance) | {
        "covariance": batch.covariance.tolist(),
        "rms": batch.rms,
        "fit_percent": batch.fit_percent,
        "samples_used": batch.n_samples,
    }
    return {
        "name": result.name,
        "output": result.data.kind.value,
        "online": online,
        "batch": offline,
        "filter_L": result.L.tolist(),
        "spectral": None if result.spectral is None else _spectral(result.spectral),
    }


def _model(model: LinearModel, resonance: Mode | None) -> dict[str, Any]:
    return {
        "theta": model.theta.tolist(),
        "A": model.A.tolist(),
        "B": model.B.tolist(),
        "sample_time_s": model.sample_time_s,
        "poles": _pairs(model.poles),
        "zeros": _pairs(model.zeros),
        "resonance": _mode(resonance),
    }


def _pairs(roots: ComplexArray) -> list[list[float]]:
    return [[float(root.real), float(root.imag)] for root in roots]


def _mode(mode: Mode | None) -> dict[str, float] | None:
    return None if mode is None else {"frequency_hz": mode.frequency_hz, "damping": mode.damping}


def _spectral(estimate: SpectralEstimate) -> dict[str, Any]:
    import numpy as np

    from hil.report.numbers import json_number

    return {
        "frequency_hz": [json_number(f) for f in estimate.frequency_hz.tolist()],
        "magnitude": [json_number(m) for m in np.abs(estimate.response).tolist()],
        "phase_rad": [json_number(p) for p in np.angle(estimate.response).tolist()],
        "magnitude_std": [json_number(s) for s in estimate.magnitude_std.tolist()],
        "coherence": [json_number(c) for c in estimate.coherence.tolist()],
        "n_averages": estimate.n_averages,
    }


def summary(results: Iterable[Identification], nominal: Mode | None) -> Table:
    """Return the table for a terminal: resonance and damping of each recording, on line and off line."""
    from rich.table import Table

    table = Table(title="Resonance and damping", title_justify="left")
    for heading in ("recording", "on line", "", "off line", "", "fit", "on-line status"):
        table.add_column(heading)
    for result in results:
        fit = f"{result.batch.fit_percent:.1f} %"
        online, offline = _shown(result.online_resonance), _shown(result.batch_resonance)
        table.add_row(result.name, *online, *offline, fit, _status(result))
    if nominal is not None:
        table.add_section()
        table.add_row("model file", "", "", *_shown(nominal), "", "")
    return table


def _shown(mode: Mode | None) -> tuple[str, str]:
    return ("none", "") if mode is None else (f"{mode.frequency_hz:.2f} Hz", f"{mode.damping:.3f}")


def _status(result: Identification) -> str:
    estimate = result.estimate
    message = estimate.reason.message
    return f"{estimate.status.value}: {message}" if message else estimate.status.value
