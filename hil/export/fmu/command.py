"""What ``hil export fmu`` does with its arguments."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from hil.config.model_file import read_model, read_model_for_recordings
from hil.errors import ModelFileError, UsageError
from hil.export.fmu import package
from hil.export.fmu.driveline import begun, driveline
from hil.problems import read_toml
from hil.recording import read_record
from hil.recording.signals_config import SignalsConfig
from hil.report.outputs import publish


def written_fmu(
    model: Path, out: Path, version: str, period_s: float, recording: Path | None, sources_only: bool, dbc: Path | None
) -> Iterator[str]:
    """Write an FMU and yield the lines that say so."""
    if out.suffix.lower() != ".fmu":
        raise UsageError(f"--out {out}: expected a name that ends in .fmu, got {out.suffix!r}")
    if read_toml(model, ModelFileError).get("laws"):
        raise UsageError(
            f"{model}: laws | expected effects of the catalogue, whose laws hil can write as C, got a law of your own "
            "in Python. Take it out, and write it in your simulation."
        )
    file = read_model(model) if recording is None else read_model_for_recordings(model)
    sensor_at = (file.signals or SignalsConfig()).output()[1].at
    line = driveline(out.stem, file.model, period_s, sensor_at)
    if recording is not None:
        line, _ = begun(line, file.model, read_record(recording, file.signals, file.on_bench, dbc))
    publish(out.parent, {out.name: lambda path: package.write(line, version, path, sources_only)})
    what = "C sources" if sources_only else "C sources and a Linux binary"
    start = "at rest" if recording is None else f"as in {recording.name}"
    yield f"{out}: FMI {version}, co-simulation and model exchange, {what}; starts {start}"
    yield from (f"note: {text}" for text in line.left_out)
