"""``hil rig``: a rig file from a few answers, and its schema for editors."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from hil.cli.printing import ask_at_terminal, print_schema, say
from hil.errors import UsageError

app = typer.Typer(add_completion=False, no_args_is_help=True)


def _answer(about: str) -> Any:
    return typer.Option(metavar="VALUE", help=about)


@app.callback(epilog="Example: hil rig new rig.toml --simulated --yes")
def rig() -> None:
    """Write a rig file, or its schema for an editor."""


@app.command(
    epilog="Example: hil rig new rig.toml. In a script: hil rig new rig.toml --yes --plc 192.168.0.10:502 --vendor-id "
    "0x3E7 --product-code 0x402 --rated-torque-nm 600 --torque-limit-nm 100 --inertia-kg-m2 100 --speed-rad-s 60"
)
def new(
    context: typer.Context,
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The rig file; a new one.")] = Path("rig.toml"),
    simulated: Annotated[
        bool, typer.Option("--simulated", help="For the simulated rig of hil sim: every answer has a default.")
    ] = False,
    eds: Annotated[
        Path | None,
        typer.Option(
            "--eds", metavar="EDS", help="Data sheet (EDS, DCF) of both inverters, in place of the shipped one."
        ),
    ] = None,
    yes: Annotated[bool, typer.Option("--yes", help="Ask nothing: use defaults for what is not given.")] = False,
    name: Annotated[str | None, _answer("Name of the rig, for people.")] = None,
    can: Annotated[str | None, _answer("CAN bus, INTERFACE:CHANNEL.")] = None,
    period_s: Annotated[str | None, _answer("SYNC period in seconds.")] = None,
    plc: Annotated[str | None, _answer("PLC, HOST:PORT.")] = None,
    node_m1: Annotated[str | None, _answer("CANopen node of inverter m1.")] = None,
    node_m2: Annotated[str | None, _answer("CANopen node of inverter m2.")] = None,
    vendor_id: Annotated[str | None, _answer("Vendor ID of both inverters, object 0x1018:1.")] = None,
    product_code: Annotated[str | None, _answer("Product code of both inverters, object 0x1018:2.")] = None,
    mode: Annotated[str | None, _answer("Mode of operation: cyclic_synchronous_torque or profile_torque.")] = None,
    rated_torque_nm: Annotated[str | None, _answer("Rated torque of one inverter, object 0x6076.")] = None,
    torque_limit_nm: Annotated[str | None, _answer("Most torque one inverter may ever give here.")] = None,
    inertia_kg_m2: Annotated[str | None, _answer("Inertia of vehicle and driveline at the motor shaft.")] = None,
    speed_rad_s: Annotated[str | None, _answer("Motor speed of the cruise.")] = None,
) -> None:
    """Ask what is connected, and write a rig file with a comment on every key; never over one that is there.

    Asks for what is not given as an option, and again where an answer does not fit. On a vehicle nothing that limits
    torque has a default. Guard, PRBS and experiments follow from the torque limit. rig.schema.json is written next to
    it, for editors.

    With --eds identity, mode, and from a DCF node id and bit rate, are the data sheet's; what it does not say and the
    drive needs is written with its reason. On a vehicle such a line is a comment until somebody fills it in.
    """
    from hil.config.new_rig import QUESTIONS, answers, new_drive, rig_text
    from hil.config.schema import schema_text
    from hil.config.table import FileKind
    from hil.files import refuse_existing, write_new

    refuse_existing(file)
    given: dict[str, str | None] = {question.name: context.params[question.name] for question in QUESTIONS}
    if not yes and not sys.stdin.isatty():
        raise UsageError("expected someone at a terminal to ask, or --yes, got neither. See: hil rig new --help")
    drive = None if eds is None else new_drive(eds, file, simulated)
    kind = "the simulated rig of hil sim" if simulated else "a vehicle; for the simulated rig: --simulated"
    ask = None if yes else ask_at_terminal(f"A rig file for {kind}.")
    given_texts = {key: text for key, text in given.items() if text is not None}
    found = answers(given_texts, simulated, ask, None if drive is None else drive.defaults)
    write_new(file, rig_text(found, file, simulated, () if drive is None else drive.lines))
    say(f"{file}: written. Go through it, then: hil check {file}")
    schema = file.with_name(FileKind.RIG.value)
    if not schema.exists():
        write_new(schema, schema_text(FileKind.RIG))
        say(f"{schema}: written, for editors")


@app.command(epilog="Example: hil rig schema --out rig.schema.json")
def schema(
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE", help="File to write; else it is printed.")
    ] = None,
) -> None:
    """Print the JSON schema of rig files, for editors that read `#:schema ./rig.schema.json`."""
    from hil.config.table import FileKind

    print_schema(FileKind.RIG, out)
