"""``hil model``: what helps to write a model file."""

from __future__ import annotations

import sys
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeVar

import typer

from hil.cli.options import Dbc
from hil.cli.printing import ask_at_terminal, print_schema, say
from hil.errors import UsageError

if TYPE_CHECKING:
    from hil.config.new_model import Known

USUAL = "two_mass"

Choice = TypeVar("Choice", bound=Enum)

app = typer.Typer(add_completion=False, no_args_is_help=True)


@app.callback(epilog="Example: hil model new bus.toml --recording drive.mf4")
def model() -> None:
    """Write a new model file, or the schema of model files for an editor."""


@app.command(
    epilog="Example: hil model new bus.toml. In a script: hil model new bus.toml --yes --recording drive.mf4 --value "
    "J_M=1.6 --value J_L=95 --value k=4200 --value c=9 --value b_M=0.35 --value b_L=0.9 --tolerance k=0.3"
)
def new(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The model file; a new one.")] = Path("model.toml"),
    structure: Annotated[
        str | None,
        typer.Option("--structure", metavar="NAME", help="one_mass, two_mass, three_mass or joint; else two_mass."),
    ] = None,
    motion: Annotated[str, typer.Option("--motion", metavar="NAME", help="rotation or translation.")] = "rotation",
    value: Annotated[
        list[str] | None, typer.Option("--value", metavar="NAME=NUMBER", help="A parameter, SI; repeatable.")
    ] = None,
    tolerance: Annotated[
        list[str] | None,
        typer.Option(
            "--tolerance", metavar="[NAME=]NUMBER", help="Relative tolerance, of one parameter or of all; repeatable."
        ),
    ] = None,
    identification: Annotated[
        Path | None,
        typer.Option("--from", metavar="FILE", help="identification.json of hil identify: values and intervals."),
    ] = None,
    run: Annotated[
        str | None,
        typer.Option("--run", metavar="NAME", help="Recording of --from; else the most certain one."),
    ] = None,
    recording: Annotated[
        Path | None, typer.Option("--recording", metavar="REC", help="Look into it, and write its [signals].")
    ] = None,
    dbc: Dbc = None,
    yes: Annotated[bool, typer.Option("--yes", help="Ask nothing: missing values are an error.")] = False,
) -> None:
    """Ask for structure, values and tolerances, and write a model file with a comment on every line.

    Asks for what is not given as an option or by an identification; never writes over a file that is there.
    """
    from estimator.physics.model import DrivelineModel, Motion, Structure
    from hil.config.new_model import TOLERANCE, assignments, model_text, parameters
    from hil.files import refuse_existing, write_new
    from hil.recording.look import look

    refuse_existing(file)
    may_ask = not yes and sys.stdin.isatty()
    ask = ask_at_terminal("A model file.") if may_ask and not value else None
    if structure is None and ask is not None:
        structure = ask(f"structure: {', '.join(each.value for each in Structure)}", USUAL, "").strip()
    shape = _member(Structure, "--structure", structure or USUAL)
    kind = _member(Motion, "--motion", motion)
    values = assignments("--value", value or (), shape)
    own, usual = _tolerances(tolerance or (), TOLERANCE)
    known = {} if identification is None else _known(identification, run)
    signals = () if recording is None else look(recording, dbc).signals
    complete = set(shape.parameter_names) <= {*values, *known}
    if not (yes or complete or may_ask):
        raise UsageError("expected someone at a terminal to ask, or --yes with every --value, got neither")
    if ask is None and may_ask and not complete:
        ask = ask_at_terminal("A model file.")
    found = parameters(shape, kind, values, assignments("--tolerance", own, shape), usual, known, ask)
    built = DrivelineModel(structure=shape, motion=kind, parameters=found)
    write_new(file, model_text(file, built, known, signals, recording))
    say(f"{file}: written. Go through it, then: hil diagnose REC --model {file} --out report")


def _member(kind: type[Choice], option: str, text: str) -> Choice:
    """Return the member of that value."""
    found = next((member for member in kind if member.value == text), None)
    if found is None:
        raise UsageError(f"{option} {text} | expected one of {', '.join(member.value for member in kind)}")
    return found


def _tolerances(texts: list[str] | tuple[str, ...], usual: float) -> tuple[list[str], float]:
    """Return the tolerances of single parameters, as they were given, and that of all others."""
    own = [text for text in texts if "=" in text]
    for text in texts:
        if "=" in text:
            continue
        try:
            usual = float(text)
        except ValueError as error:
            raise UsageError(f"--tolerance {text} | expected a number, or NAME=NUMBER") from error
    return own, usual


def _known(path: Path, run: str | None) -> dict[str, Known]:
    """Return what an identification knows of the parameters."""
    from estimator.physics.model import STRICTLY_POSITIVE, Parameter
    from hil.config.new_model import LEAST_TOLERANCE, Known
    from hil.report.identification_input import physical_values

    return {
        name: Known(
            Parameter.measured(max(found.value, 0.0), found.half_width, LEAST_TOLERANCE),
            f"identified from {found.recording}",
        )
        for name, found in physical_values(path, run).items()
        if found.value > 0.0 or (name not in STRICTLY_POSITIVE and found.value + found.half_width > 0.0)
    }


@app.command(epilog="Example: hil model schema --out model.schema.json")
def schema(
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE", help="File to write; else it is printed.")
    ] = None,
) -> None:
    """Print the JSON schema of model files, for editors that read `#:schema ./model.schema.json`."""
    from hil.config.table import FileKind

    print_schema(FileKind.MODEL, out)
