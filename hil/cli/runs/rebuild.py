"""``hil runs rebuild``: the store brought up to what is in the folder."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import typer

from hil.cli.runs.options import HERE, AsJson, Folder

if TYPE_CHECKING:
    from hil.store.rebuild import Rebuilt


def rebuild(store: Folder = HERE, as_json: AsJson = False) -> None:
    """Update the store from the folder: enter recordings, find moved ones, fix a damaged store.

    What can still be read of a damaged store is kept, notes and results included; the damaged file is kept.
    """
    from hil.errors import StoreError
    from hil.store.rebuild import rebuild as rebuilt
    from hil.store.run_store import store_of

    if not store.is_dir():
        raise StoreError(store_of(store), f"expected an existing folder, got {store}")
    result = rebuilt(store)
    for problem in result.unreadable:
        typer.echo(f"not entered: {problem}", err=True)
    for text in result.lost_notes:
        typer.echo(f"note to a run that is lost: {text}", err=True)
    if as_json:
        typer.echo(json.dumps(_document(result)))
        return
    if result.damaged is not None:
        typer.echo(f"the damaged store is kept as {result.damaged}; {result.before} runs could be read of it")
    typer.echo(f"{store_of(store)}: {_said(result)}")


def _document(result: Rebuilt) -> dict[str, Any]:
    return {
        "schema": "hil.runs_rebuild/1",
        "kept": result.before,
        "entered": result.found,
        "moved": result.moved,
        "copies": result.copies,
        "attached": result.attached,
        "unreadable": list(result.unreadable),
        "lost_notes": list(result.lost_notes),
        "damaged": None if result.damaged is None else str(result.damaged),
    }


def _said(result: Rebuilt) -> str:
    counts = (
        (result.before, "runs kept"),
        (result.found, "entered"),
        (result.moved, "found under a new name"),
        (result.copies, "copies left out"),
        (result.attached, "results attached"),
        (len(result.unreadable), "recordings unreadable"),
    )
    return ", ".join(f"{count} {what}" for count, what in counts if count) or "nothing to enter"
