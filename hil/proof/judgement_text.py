"""A judgement for people: the opened seal next to the verdict."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rich.console import Group, RenderableType
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from hil.proof.compare import Comparison
from hil.proof.judge import Judgement, Outcome

_COLOURS = {Outcome.RIGHT: "green", Outcome.ABSTAINED: "yellow", Outcome.INCOMPLETE: "yellow"}


def judgement_text(judgement: Judgement, truth: Mapping[str, Any], commitment: str) -> RenderableType:
    """Return what a terminal shows once the seal is open."""
    said = Text(
        f"concealed: {_listed(judgement.hidden)} {_sizes(truth)}\n"
        f"named:     {_listed(judgement.named)}\n"
        f"The seal matches the commitment {commitment[:16]}... made before the rig was driven."
    )
    colour = _COLOURS.get(judgement.outcome, "red")
    title = Text(f" seal opened: {judgement.outcome.value} ", style="bold")
    return Group(Panel(said, title=title, border_style=colour), _table(judgement.sizes))


def _listed(names: tuple[str, ...]) -> str:
    return ", ".join(names) or "nothing"


def _sizes(truth: Mapping[str, Any]) -> str:
    sizes = [f"{name} = {value:.4g}" for hidden in truth["hidden"].values() for name, value in hidden.items() if value]
    return f"({', '.join(sizes)})" if sizes else ""


def _table(sizes: tuple[Comparison, ...]) -> Table:
    table = Table(box=None, pad_edge=False)
    for heading in ("truth against estimate", "unit", "true", "found", "95 % interval", "holds the truth"):
        table.add_column(heading, justify="left" if heading in ("truth against estimate", "unit") else "right")
    for size in sizes:
        interval = "" if size.ci95 is None else f"{size.ci95[0]:.4g} to {size.ci95[1]:.4g}"
        holds = {True: "yes", False: "no", None: ""}[size.inside]
        table.add_row(size.what, size.unit, f"{size.true:.4g}", f"{size.found:.4g}", interval, holds)
    return table
