"""``hil export``: the estimator for a PLC, the driveline for other simulations."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hil.cli.options import Dbc
from hil.cli.printing import say
from hil.errors import UsageError
from hil.export import FmiVersion, Tc6

if TYPE_CHECKING:
    from hil.export.plc_estimator import PlcEstimator
    from hil.export.structured_text import Precision

app = typer.Typer(add_completion=False, no_args_is_help=True)

Identification = Annotated[
    Path | None,
    typer.Argument(metavar="[IDENTIFICATION]", help="identification.json of hil identify; without it --adaptive."),
]
Run = Annotated[str | None, typer.Option("--run", metavar="NAME", help="Recording whose observation filter is taken.")]
Adaptive = Annotated[
    bool,
    typer.Option("--adaptive", help="Let the filter follow the estimate (AFOLOE): where there is no batch model."),
]
Cycle = Annotated[float, typer.Option("--cycle", metavar="SECONDS", help="Period of the PLC task that will call it.")]
Profile = Annotated[
    str,
    typer.Option(
        "--profile",
        metavar="PROFILE",
        help="Adaptation gain, NAME or NAME:k=v,...: decreasing_then_constant_trace (the paper's), decreasing_gain, "
        "constant_forgetting, variable_forgetting, variable_forgetting_then_constant_trace, constant_trace, "
        "constant_gain.",
    ),
]
Single = Annotated[bool, typer.Option("--single", help="32-bit REAL instead of 64-bit LREAL.")]

CYCLE_S = 0.01
PROFILE = "decreasing_then_constant_trace"


@app.callback(epilog="Example: hil export st identified/identification.json --run cruise --out estimator.st")
def export() -> None:
    """Write the on-line estimator for a PLC, or a driveline for another simulation."""


@app.command(epilog="Example: hil export st identified/identification.json --run cruise --out estimator.st")
def st(
    out: Annotated[
        Path, typer.Option("--out", metavar="FILE", help="Structured Text to write; replaced where it is there.")
    ],
    identification: Identification = None,
    run: Run = None,
    adaptive: Adaptive = False,
    cycle: Cycle = CYCLE_S,
    profile: Profile = PROFILE,
    single: Single = False,
) -> None:
    """Write the estimator with its settings as IEC 61131-3 Structured Text for the PLC.

    One text of data types, function blocks and an example; FB_HilEstimator is the block to call.
    """
    from hil.export.plc_estimator import written_estimator
    from hil.export.structured_text import structured_text

    estimator = written_estimator(identification, run, adaptive, cycle, profile)
    _write(out, structured_text(estimator, _precision(single)), estimator)


@app.command(epilog="Example: hil export plcopen identified/identification.json --run cruise --out estimator.xml")
def plcopen(
    out: Annotated[
        Path, typer.Option("--out", metavar="FILE", help="PLCopen XML to write; replaced where it is there.")
    ],
    identification: Identification = None,
    run: Run = None,
    adaptive: Adaptive = False,
    cycle: Cycle = CYCLE_S,
    profile: Profile = PROFILE,
    single: Single = False,
    tc6: Annotated[
        Tc6,
        typer.Option(
            "--tc6",
            metavar="VERSION",
            help="Version of the format, 2.01 or 2.0; CODESYS and TwinCAT themselves write 2.0.",
        ),
    ] = Tc6.V2_01,
) -> None:
    """Write the same as PLCopen XML, which CODESYS, TwinCAT and others import in one step.

    Data types, function blocks and an example; FB_HilEstimator is the block to call.
    """
    from datetime import UTC, datetime

    from hil.export.plc_estimator import written_estimator
    from hil.export.plcopen import plcopen_xml

    estimator = written_estimator(identification, run, adaptive, cycle, profile)
    _write(out, plcopen_xml(estimator, datetime.now(UTC), _precision(single), tc6), estimator)


def _precision(single: bool) -> Precision:
    from hil.export.structured_text import Precision

    return Precision.SINGLE if single else Precision.DOUBLE


def _write(out: Path, text: str, estimator: PlcEstimator) -> None:
    from hil.result_folder import publish

    publish(out.parent, {out.name: lambda path: path.write_text(text, encoding="ascii")})
    orders = estimator.settings.orders
    say(f"{out}: {estimator.origin}; na {orders.na}, nb {orders.nb}, nk {orders.nk}; call FB_HilEstimator")


@app.command(epilog="Example: hil export damper damper/damper.toml --out damper.st")
def damper(
    design: Annotated[Path, typer.Argument(metavar="DAMPER", help="damper.toml of hil design damper.")],
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="Structured Text, .st, or C, .c; replaced.")],
) -> None:
    """Write active damping for a PLC or a drive: the torque of hil run --damper, to the bit."""
    from hil.config.damper_file import drivable
    from hil.export.damper import damper_text
    from hil.result_folder import publish

    file, rig = drivable(design)
    text = damper_text(file, rig, out.suffix.lower())
    publish(out.parent, {out.name: lambda path: path.write_text(text, encoding="ascii")})
    say(f"{out}: for {rig.name}; call it every {file.period_s:g} s, with the frequency of FB_HilEstimator")


@app.command(epilog="Example: hil export law out/augmented.toml --out law.st")
def law(
    model: Annotated[Path, typer.Argument(metavar="MODEL", help="augmented.toml with a law without a name.")],
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="Structured Text to write; replaced.")],
    table: Annotated[
        str | None, typer.Option("--table", metavar="PLACE", help="Which of several: shaft_twist, motor_speed, ...")
    ] = None,
) -> None:
    """Write a law without a name for a PLC: the curve of [tables.PLACE], as the simulation has it."""
    from hil.export.law import law_text
    from hil.result_folder import publish

    text = law_text(model, table)
    publish(out.parent, {out.name: lambda path: path.write_text(text, encoding="ascii")})
    say(f"{out}: call FB_HilLaw")


@app.command(epilog="Example: hil export fmu out/augmented.toml --recording run_1.csv --out bus.fmu")
def fmu(
    model: Annotated[Path, typer.Argument(metavar="MODEL", help="Model file, nominal or augmented.")],
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="FMU to write; replaced where it is there.")],
    fmi: Annotated[
        FmiVersion, typer.Option("--fmi", metavar="VERSION", help="Version of the standard, 2.0 or 3.0.")
    ] = FmiVersion.V2,
    period: Annotated[
        float | None,
        typer.Option(
            "--period", min=1e-5, metavar="SECONDS", help="Usual communication step: 0.01, or that of --recording."
        ),
    ] = None,
    recording: Annotated[
        Path | None,
        typer.Option(
            "--recording", metavar="REC", help="Start as in this recording: initial state, load, phases, moments."
        ),
    ] = None,
    sources_only: Annotated[
        bool, typer.Option("--sources-only", help="C sources without a binary: no compiler is needed.")
    ] = False,
    dbc: Dbc = None,
) -> None:
    """Write the driveline as an FMU, for co-simulation.

    Inputs T_M1, T_M2, T_load; outputs speeds, motor angle, shaft torque; each parameter with its value. It holds C
    sources and a Linux binary, which is made by the C compiler of this machine.
    """
    from hil.export.fmu.package import written_fmu

    if None not in (period, recording):
        raise UsageError("expected one usual step, got --period with --recording, whose own it is. Leave --period out.")
    for line in written_fmu(model, out, fmi.value, period or CYCLE_S, recording, sources_only, dbc):
        say(line)
