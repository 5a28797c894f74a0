"""``hil prove``: sealed challenges, answered by the public command line, opened and scored."""

from __future__ import annotations

import secrets
from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from drivers.foreign_file import read_regular_text
from hil.cli.options import Scheduler, hold, require_dask
from hil.cli.printing import progress_bar, say
from hil.errors import UsageError

SEEDS = 2**31
RIG_SEED = 11
"""What the sealed rigs are drawn from where no seed is given."""

SHORT = 12
"""Cases of the short form: a few minutes on two cores."""

Folder = Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a set of cases.")]
Jobs = Annotated[int, typer.Option(min=1, help="Cases at a time.")]
Cases = Annotated[int, typer.Option(min=1, max=999, help="How many cases.")]
Seed = Annotated[int | None, typer.Option(min=0, help="Seed of everything; else at random, and not reported.")]
KeyFile = Annotated[Path | None, typer.Option("--key-file", metavar="FILE", help="File of the key, outside DIR.")]
Data = Annotated[
    Path | None, typer.Option(metavar="DATA", help="Folder of the real recordings; without it they are left out.")
]

app = typer.Typer(add_completion=False, no_args_is_help=False)


@app.callback(invoke_without_command=True, epilog="Example: hil prove --out out/proof --cases 12")
def prove(
    context: typer.Context,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder for cases, verdicts and scoreboard.")] = Path(
        "out/proof"
    ),
    cases: Cases = SHORT,
    seed: Seed = None,
    jobs: Jobs = 2,
    rigs: Annotated[bool, typer.Option(help="Drive the sealed rigs too: CANopen and Modbus.")] = True,
    data: Data = None,
) -> None:
    """Prove the claim: sealed cases, sealed rigs and, with --data, real recordings; one scoreboard.

    Called again it continues where it was interrupted. The key is kept next to DIR, in DIR.key. To check the claim
    yourself, make the set on one machine, answer it on another, and open it with the key.
    """
    if context.invoked_subcommand is not None:
        return
    hold(out)
    key_path = out.with_name(f"{out.name}.key")
    if not key_path.exists():
        make(out, cases, seed, jobs, key_path)
    _require_set(out, key_path)
    run(out, jobs)
    if rigs:
        wire(out, None, RIG_SEED if seed is None else seed)
    if data is not None:
        real(data, out, None, jobs)
    open_(out, None, key_path, None, jobs)


@app.command(epilog="Example: hil prove make proof --cases 200 --key-file proof.key")
def make(
    folder: Folder,
    cases: Cases = SHORT,
    seed: Seed = None,
    jobs: Jobs = 2,
    key_file: KeyFile = None,
) -> None:
    """Draw, record and seal a set of cases. Prints the key, or writes it to FILE."""
    from hil.proof.seal import new_key, parse_key
    from hil.proof.sealed_set import make as make_set
    from hil.result_folder import require_folder

    hold(folder)
    key = new_key()
    if key_file is not None:
        _require_outside(key_file, folder)
        require_folder(key_file.parent)
    chosen = secrets.randbelow(SEEDS) if seed is None else seed
    with progress_bar() as progress:
        make_set(folder, cases, chosen, parse_key(key), jobs, progress)
    if key_file is None:
        say(f"key: {key}")
    else:
        key_file.touch(mode=0o600)
        key_file.write_text(f"{key}\n", encoding="utf-8")
        say(f"key: in {key_file}")
    say(f"made: {folder}/cases   next: hil prove run {folder}")


@app.command(epilog="Example: hil prove run proof")
def run(folder: Folder, jobs: Jobs = 2, scheduler: Scheduler = None) -> None:
    """Let the public command answer every case; it sees only DIR/cases, one case at a time."""
    from hil.proof.answers import answer

    hold(folder)
    with _pool(scheduler) as pool, progress_bar() as progress:
        digest = answer(folder.absolute(), jobs, progress, pool=pool)
    say(f"verdicts: {folder}/verdicts   digest: {digest}")


@app.command("open", epilog="Example: hil prove open proof --key-file proof.key")
def open_(
    folder: Folder,
    key: Annotated[str | None, typer.Option(metavar="KEY", help="As hil prove make has printed it.")] = None,
    key_file: KeyFile = None,
    verdicts: Annotated[
        str | None, typer.Option(metavar="DIGEST", help="As hil prove run has printed it: refuse other verdicts.")
    ] = None,
    jobs: Jobs = 2,
) -> None:
    """Open the seals, check that nothing was changed, score the verdicts; writes DIR/scoreboard.html and .json."""
    from hil.proof.answers import judge_set
    from hil.proof.real import read_real
    from hil.proof.rigs import read_rows
    from hil.proof.scoreboard import PAGE, REAL, WIRE, Board, scoreboard_files
    from hil.proof.seal import parse_key
    from hil.proof.sealed_set import CASES
    from hil.provenance import provenance
    from hil.result_folder import publish

    hold(folder)
    secret = parse_key(_key_text(key, key_file))
    with progress_bar() as progress:
        rows = judge_set(folder, secret, jobs, progress, verdicts)
    shown = folder / CASES
    made = provenance(sorted(shown.rglob("*.toml")), sorted(shown.rglob("*.csv")))
    publish(folder, scoreboard_files(Board(rows, read_rows(folder / WIRE), read_real(folder / REAL), made)))
    for row in rows:
        if not row["success"]:
            found = row["fault"] or ", ".join(row.get("named", ())) or row.get("verdict")
            say(f"{row['case']}: {row['outcome']}: hidden {row['kind']}, found {found}")
    right = sum(row["success"] for row in rows)
    say(f"{right} of {len(rows)} as they should be   scoreboard: {folder / PAGE}")


@app.command(epilog="Example: hil prove wire proof")
def wire(
    folder: Folder,
    only: Annotated[list[str] | None, typer.Option(metavar="RIG", help="Only this one; may be repeated.")] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of buses and sizes.")] = RIG_SEED,
) -> None:
    """Drive rigs with something concealed in their slaves, over CANopen and Modbus; writes DIR/wire/wire.json."""
    from hil.proof.rigs import WIRED, run_wire
    from hil.proof.scoreboard import WIRE

    hold(folder)
    with progress_bar() as progress:
        rows = run_wire(folder / WIRE, seed, only or list(WIRED), progress)
    for row in rows:
        found = ", ".join(row.get("named", ())) or row.get("verdict", row["said"])
        say(f"{row['case']}: {row['outcome']}: {found}")
    say(f"{sum(row['success'] for row in rows)} of {len(rows)} rigs as they should be")


@app.command(epilog="Example: hil prove real data proof")
def real(
    data: Annotated[Path, typer.Argument(metavar="DATA", help="Folder of the real recordings.")],
    folder: Folder,
    only: Annotated[list[str] | None, typer.Option(metavar="NAME", help="Only this one; may be repeated.")] = None,
    jobs: Jobs = 1,
    scheduler: Scheduler = None,
) -> None:
    """Conceal what is known of real recordings, diagnose, compare; writes DIR/real/real.json."""
    from hil.proof.real import run_real
    from hil.proof.scoreboard import REAL

    hold(folder)
    with _pool(scheduler) as pool, progress_bar() as progress:
        results = run_real(data.absolute(), folder.absolute() / REAL, only or (), jobs, progress, pool=pool)
    for result in results:
        say(f"{result['name']}: {'as it should be' if result['named_right'] else 'not as it should be'}")


@contextmanager
def _pool(scheduler: str | None) -> Iterator[Executor | None]:
    """Give the cores of a Dask cluster, which sees the same folders; None for this machine's."""
    if scheduler is None:
        yield None
        return
    require_dask()
    from hil.fleet.run import Engine, client_of

    with client_of(Engine(scheduler)) as client:
        yield client.get_executor(pure=False)  # type: ignore[no-untyped-call]


def _key_text(key: str | None, key_file: Path | None) -> str:
    if (key is None) == (key_file is None):
        raise UsageError("expected the key once, with --key or --key-file. hil prove make has printed or written it.")
    return key if key is not None else read_regular_text(str(key_file))


def _require_set(folder: Path, key_file: Path) -> None:
    if not folder.exists():
        raise UsageError(
            f"{key_file}: expected the set that this key opens in {folder}, which is not there (deleted?). "
            f"Remove the key to make a new set, or choose another folder."
        )


def _require_outside(key_file: Path, folder: Path) -> None:
    if folder.resolve() in key_file.resolve().parents:
        raise UsageError(
            f"{key_file}: expected a file outside {folder}: whoever answers the cases must not see the key."
        )
    if key_file.exists():
        raise UsageError(f"{key_file}: expected a file that is not there yet: it may be the key of another set.")
