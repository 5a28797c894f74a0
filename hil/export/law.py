"""A law without a name as Structured Text: the curve of a model's table, as the simulation has it."""

from __future__ import annotations

from pathlib import Path
from string import Template
from typing import Final

from estimator.physics.driveline import unit
from estimator.physics.table_signals import slopes_at_knots
from estimator.physics.tables import PLACES
from hil.config.model_file import read_model
from hil.config.new_law import chosen_table
from hil.errors import ModelFileError
from hil.version import __version__

_ST: Final = Template(
    """\
(* FB_HilLaw: a torque over $over. Written by hil $version from $source, IEC 61131-3 Structured Text.

   A piecewise cubic through the knots (Fritsch and Butland, 1984); beyond them a straight line, which no recording has
   shown. A positive value is a $sign. *)
FUNCTION_BLOCK FB_HilLaw
VAR_INPUT
    x : LREAL;                 (* $over [$unit] *)
END_VAR
VAR_OUTPUT
    value : LREAL;             (* torque [$torque_unit] *)
END_VAR
VAR    (* a table; nothing writes to it *)
    knots  : ARRAY[1..$count] OF LREAL := [$knots];
    values : ARRAY[1..$count] OF LREAL := [$values];
    slopes : ARRAY[1..$count] OF LREAL := [$slopes];
END_VAR
VAR
    i        : INT;
    wide     : LREAL;
    straight : LREAL;
    square   : LREAL;
    cube     : LREAL;
    t        : LREAL;
END_VAR

IF x <= knots[1] THEN
    value := values[1] + slopes[1] * (x - knots[1]);
ELSIF x >= knots[$count] THEN
    value := values[$count] + slopes[$count] * (x - knots[$count]);
ELSE
    i := 1;
    WHILE x > knots[i + 1] DO
        i := i + 1;
    END_WHILE;
    wide := knots[i + 1] - knots[i];
    straight := (values[i + 1] - values[i]) / wide;
    square := 3.0 * straight - 2.0 * slopes[i] - slopes[i + 1];
    cube := slopes[i] + slopes[i + 1] - 2.0 * straight;
    t := (x - knots[i]) / wide;
    value := values[i] + wide * t * (slopes[i] + t * (square + t * cube));
END_IF;
END_FUNCTION_BLOCK
"""
)


def law_text(source: Path, place: str | None) -> str:
    """Return the function block of a table of a model file; ASCII only.

    Raises
    ------
    UsageError, ModelFileError
        Where the model has no table, or several and none is chosen, or one over an angle that repeats itself.
    """
    model = read_model(source).model
    table = chosen_table(source, model, place)
    at, count = PLACES[table.place], len(table.knots)
    if at.periodic:
        raise ModelFileError(source, f"tables.{table.place} | expected a law that does not repeat itself | got one")
    numbers = {"knots": table.knots, "values": table.values, "slopes": slopes_at_knots(table)}
    return _ST.substitute(
        {name: ", ".join(f"{value:.17E}" for value in of) for name, of in numbers.items()},
        count=count,
        over=at.over,
        sign=at.sign,
        unit=unit(at.dimension, model.motion),
        torque_unit=unit("torque", model.motion),
        source=source.name.encode("ascii", "replace").decode().replace("*", "?"),
        version=__version__,
    )
