"""Hands the work of a fleet to Dask: a cluster of this machine's cores, or one that runs elsewhere.

Scheduling, restarting workers and trying again are Dask's own. What is in flight is bounded, so that scheduler and
client hold as much for 100 recordings as for 10,000.
"""

from __future__ import annotations

import logging
import tempfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from functools import cache
from itertools import groupby, islice
from typing import Any, TypeVar

import dask
from dask.utils import parse_bytes
from distributed import Client, Future, KilledWorker, LocalCluster, Security, WorkerPlugin, as_completed
from distributed.comm.core import CommClosedError

from hil.child import safe_path
from hil.errors import UsageError
from hil.fleet.dataset import DatasetRow, Writer
from hil.fleet.known import Survey, stamp
from hil.fleet.sources import FleetRecording, Seen, in_order
from hil.fleet.tasks import PATIENCE, FleetJob, Outcome, analyse, describe, place, row_of

OF_DASK: tuple[str, ...] = ("python", "dask", "distributed", "cloudpickle")
"""What client, scheduler and workers must have alike to understand one another."""

OF_RESULTS: tuple[str, ...] = ("hil-driveline", "numpy", "scipy", "numba")
"""And what client and workers must to find the same."""

HANDSHAKE_S = 10.0

Item = TypeVar("Item")

StageProgress = Callable[[str, int, int], None]
"""Called with the stage, how much of it is done, and how much there is."""

RESTARTED_WITHIN = "1 h"
"""A worker that has died and is back later is not used again, and where it was the last one all would wait for ever: by
default after 15 s, which a restart takes on a busy machine."""

LEAST_MEMORY = 512 << 20  # of a worker [bytes]: hil alone takes 300 MiB, and Dask kills one at 95 % of its limit


@dataclass(frozen=True, slots=True)
class Engine:
    """Where the work is done: on a cluster that runs, or on workers of this machine, each with one thread."""

    scheduler: str | None = None  # address of a cluster's; None: this machine works
    workers: int = 1  # processes of this machine
    memory: str = "auto"  # of each worker, as Dask writes it; "auto" divides what there is
    retries: int = 2  # how often Dask tries again what a worker died of, or failed at
    dashboard: bool = False  # of this machine's cluster: a page of Dask's, which every local user can open


@contextmanager
def client_of(engine: Engine) -> Iterator[Client]:
    """Connect to a cluster, and refuse it where its versions are others."""
    if engine.scheduler is not None:
        try:
            client = Client(engine.scheduler, timeout=HANDSHAKE_S)
        except (OSError, ValueError, TypeError) as error:
            raise UsageError(
                f"--scheduler {engine.scheduler}: expected a Dask scheduler that answers, got: {error}. Start it "
                "(dask scheduler), or leave the option out to work on this machine."
            ) from error
        with client:
            _require_alike(client)
            yield client
        return
    _require_room(engine.memory)
    with tempfile.TemporaryDirectory(prefix="hil-fleet-") as folder, _own_cluster(engine, folder) as client:
        yield client


@contextmanager
def _own_cluster(engine: Engine, folder: str) -> Iterator[Client]:
    """Start a cluster on this machine that nobody else can use: Dask runs whatever reaches its ports.

    They are on loopback, which all users share, so both sides of a connection show a certificate, which is in the
    memory of these processes only. Workers look for modules neither here nor in a folder others can write to.
    """
    settings = {
        "distributed.scheduler.allowed-failures": engine.retries,
        "distributed.deploy.lost-worker-timeout": RESTARTED_WITHIN,
        "distributed.worker.daemon": False,
        "distributed.worker.http.routes": [],
        "temporary-directory": folder,
        **({} if engine.dashboard else {"distributed.scheduler.http.routes": []}),
    }
    with (
        safe_path(),
        dask.config.set(settings),
        LocalCluster(
            n_workers=engine.workers, threads_per_worker=1, memory_limit=engine.memory, host="127.0.0.1",
            protocol="tls://", security=Security.temporary(), silence_logs=logging.CRITICAL,
            dashboard_address="127.0.0.1:0", scheduler_kwargs={"dashboard": engine.dashboard},
        ) as cluster,
        Client(cluster) as client,
    ):  # fmt: skip
        client.register_plugin(WithoutHttp())
        if not engine.dashboard:
            cluster.scheduler.http_server.stop()
        yield client


class WithoutHttp(WorkerPlugin):
    """Closes the web server that Dask gives each worker."""

    name = "without HTTP"

    def setup(self, worker: Any) -> None:
        """Close it before the first task."""
        worker.http_server.stop()


def _require_room(memory: str) -> None:
    try:
        enough = memory == "auto" or parse_bytes(memory) >= LEAST_MEMORY
    except ValueError:
        enough = False
    if not enough:
        raise UsageError(f"--memory: expected auto, or {LEAST_MEMORY >> 20}MiB or more, got {memory!r}")


def _require_alike(client: Client) -> None:
    """Refuse a cluster without workers, or of other versions."""
    versions: Any = client.get_versions(packages=[*OF_DASK[1:], *OF_RESULTS])
    if not versions["workers"]:
        raise UsageError("--scheduler: expected a cluster with workers, got none. Start some: dask worker ADDRESS")
    own = versions["client"]["packages"]
    sides = [("the scheduler", versions["scheduler"], OF_DASK)]
    sides += [(f"worker {address}", each, OF_DASK + OF_RESULTS) for address, each in versions["workers"].items()]
    differing = [
        f"{package} {own[package]} here, {there['packages'].get(package)} at {side}"
        for side, there, packages in sides
        for package in packages
        if there["packages"].get(package) != own[package]
    ]
    if differing:
        raise UsageError(f"--scheduler: expected the versions of this machine, got {'; '.join(differing)}. Align them.")


Connect = Callable[[], Client]


@contextmanager
def connecting(engine: Engine, tell: Callable[[str], None]) -> Iterator[Connect]:
    """Give what starts the cluster, or connects to it, when it is first asked: what is known needs none."""
    with ExitStack() as stack:

        @cache
        def connect() -> Client:
            client = stack.enter_context(client_of(engine))
            if engine.dashboard and engine.scheduler is None:
                tell(f"dashboard: {client.dashboard_link}, open to every user of this machine")
            return client

        yield connect


def hand_out(
    connect: Connect, items: Sequence[Item], submit: Callable[[Item], Future[Any]]
) -> Iterator[tuple[Item, Any, str]]:
    """Yield each item with its result as it comes, or with what became of it."""
    if not items:
        return
    client, waiting = connect(), iter(items)
    running = {}
    done = as_completed(loop=client.loop)
    cores = sum(client.nthreads().values()) or 1

    def begin(some: Iterable[Item]) -> None:
        for item in some:
            future = submit(item)
            running[future.key] = item
            done.add(future)

    begin(islice(waiting, cores))  # one for each: Dask blames a worker's death on all that wait there
    for future in done:
        item = running.pop(future.key)
        if future.status == "cancelled" or isinstance(error := future.exception(), CommClosedError):
            raise UsageError(
                "expected the scheduler to stay, got none: the connection is lost. What was done is kept: call again."
            )
        if isinstance(error, KilledWorker):
            times = error.allowed_failures + 1
            yield item, None, f"its worker died {times} times: out of memory, out of time, or killed"
        elif error is not None:
            yield item, None, f"{type(error).__name__}: {error}"
        else:
            yield item, future.result(), ""
        future.release()
        begin(islice(waiting, 1))


@dataclass(slots=True)
class Fleet:
    """The recordings of a fleet, described, and what is wrong with the others."""

    # each content once, in the order in which the sources name them
    recordings: list[FleetRecording] = field(default_factory=list)
    failed: list[tuple[FleetRecording, str]] = field(default_factory=list)  # with what is wrong with each
    # with the recording of the same content that counts
    duplicates: list[tuple[FleetRecording, FleetRecording]] = field(default_factory=list)

    def pieces(self, by_vehicle: bool) -> list[tuple[FleetRecording, ...]]:
        """Return what is computed together, in an order of its own: every recording, or a vehicle's on one rig."""
        ordered = sorted(
            self.recordings, key=lambda each: (in_order(each.vehicle), in_order(each.rig), each.started, each.url)
        )
        if not by_vehicle:
            return [(each,) for each in ordered]
        return [tuple(group) for _, group in groupby(ordered, key=lambda each: (each.vehicle, each.rig))]

    def remarks(self) -> list[str]:
        """Return what the reader has to know: recordings that count once, vehicles of more than one rig."""
        lines = [f"{one.url}: the same content as {other.url}, counted once" for one, other in self.duplicates]
        rigs: dict[str, set[str]] = {}
        for each in self.recordings:
            rigs.setdefault(each.vehicle, set()).add(each.rig)
        lines += [
            f"vehicle {vehicle}: recordings of {len(names)} rigs ({', '.join(sorted(names))}), kept separate"
            for vehicle, names in sorted(rigs.items(), key=lambda each: in_order(each[0]))
            if len(names) > 1
        ]
        return lines

    def place_of(self) -> Callable[[Sequence[str]], DatasetRow | None]:
        """Return what says where recordings with these checksums belong; None where they are of no one vehicle."""
        by_content = {each.sha256: each for each in self.recordings}

        def found(sums: Sequence[str]) -> DatasetRow | None:
            recordings = [by_content[each] for each in sums if each in by_content]
            is_one = len({(each.vehicle, each.rig) for each in recordings}) == 1
            return place(recordings) if is_one and len(recordings) == len(sums) else None

        return found


def survey(
    connect: Connect,
    found: Sequence[FleetRecording],
    known: Survey,
    job: FleetJob,
    engine: Engine,
    progress: StageProgress,
) -> Fleet:
    """Take the checksum and the metadata of every recording that is not known, or has changed since."""
    fleet = Fleet()
    stamps = {each.url: stamp(each.url) for each in found}
    described = {each.url: seen for each in found if (seen := known.seen(each.url, stamps[each.url]))}
    unknown = [each for each in found if each.url not in described]

    def submit(each: FleetRecording) -> Future[Any]:
        return connect().submit(describe, each, PATIENCE * job.budget_s, pure=False, retries=engine.retries)

    for number, (each, result, error) in enumerate(hand_out(connect, unknown, submit), start=1):
        if isinstance(result, Seen):
            described[each.url] = result
            known.note(each.url, stamps[each.url], result)
        else:
            fleet.failed.append((each, error or result))
        progress("reading", number, len(unknown))
    first: dict[str, FleetRecording] = {}
    for each in found:  # in their order, whichever worker was faster
        if (seen := described.get(each.url)) is None:
            continue
        one = each.seen_as(seen)
        if one.sha256 in first:
            fleet.duplicates.append((one, first[one.sha256]))
        else:
            first[one.sha256] = one
    fleet.recordings = list(first.values())
    return fleet


@dataclass(slots=True)
class Done:
    """How many pieces of work were computed, were there before, and failed."""

    computed: int = 0  # in this call
    known: int = 0  # in the dataset before
    failed: int = 0  # recordings that can't be read, and pieces without a result


def carry_out(
    connect: Connect,
    fleet: Fleet,
    job: FleetJob,
    writer: Writer,
    engine: Engine,
    by_vehicle: bool,
    progress: StageProgress,
) -> Done:
    """Compute what is not in the dataset yet, and keep it as it comes; what fails costs itself alone.

    What is in it belongs from now on where this survey has found it.
    """
    writer.settle(fleet.place_of())
    known, pieces = writer.known(), fleet.pieces(by_vehicle)
    todo = [piece for piece in pieces if job.key(piece) not in known]
    done = Done(known=len(pieces) - len(todo))

    def fail(piece: Sequence[FleetRecording], error: str) -> None:
        done.failed += 1
        writer.fail({**row_of(piece, job), "error": error})

    def submit(piece: tuple[FleetRecording, ...]) -> Future[Any]:
        return connect().submit(analyse, piece, job, pure=False, retries=engine.retries)

    try:
        for each, error in fleet.failed:
            fail((each,), error)
        for piece, result, error in hand_out(connect, todo, submit):
            if isinstance(result, Outcome) and not result.error:
                writer.add(result.rows, result.verdict)
                done.computed += 1
            else:
                fail(piece, error or result.error)
            progress(job.command, done.computed + done.failed - len(fleet.failed), len(todo))
    finally:
        writer.finish()
    return done
