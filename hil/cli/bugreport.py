"""``hil bugreport``: one file for a supporter, and nothing private in it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hil.cli.printing import say

app = typer.Typer(add_completion=False)


@app.command(epilog="Example: hil bugreport report.zip --rig examples/rig.toml")
def bugreport(
    out: Annotated[Path, typer.Argument(metavar="OUT", help="The report, a ZIP; a new file.")],
    rig: Annotated[list[Path] | None, typer.Option(metavar="RIG", help="Rig file; may be repeated.")] = None,
    runs: Annotated[Path, typer.Option(metavar="DIR", help="Folder of the recordings: their last run.")] = Path(),
) -> None:
    """Pack versions, rig file, logs and the metadata of the last run; list the contents.

    Keys, passwords, certificates, folders and names of user and machine are taken out. Nothing is sent anywhere.
    """
    from hil.files import refuse_existing, write_new
    from hil.support.bug_report import bug_report

    refuse_existing(out)
    report = bug_report(tuple(rig or ()), runs)
    write_new(out, report.zipped())
    say(f"{out}: {len(report.parts)} files")
    for part in report.parts:
        say(f"  {part.name:<20} {len(part.content):>8} bytes")
    taken = ", ".join(f"{count} {kind}" for kind, count in sorted(report.taken_out.items()) if count)
    say(f"taken out: {taken or 'nothing private was found'}")
    for line in report.missing:
        say(f"not in it: {line}")
    say("Read it before you send it.")
