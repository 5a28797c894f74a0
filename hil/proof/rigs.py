"""Sealed rigs: served in a process of their own, driven and diagnosed by the public command line alone.

It only has CANopen and Modbus. What is concealed is in the driveline, an inverter's firmware, a sensor, or the PLC.
"""

from __future__ import annotations

import json
import re
import subprocess
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import IO, Any, Final

import tomlkit

from drivers.foreign_file import read_regular_text
from hil.child import end, environment, python, start
from hil.errors import RunAborted, UsageError
from hil.proof.command import CommandFailed, replace_own, run_hil
from hil.proof.kinds import kind
from hil.proof.score import Answer, score
from hil.proof.seal import verify
from hil.proof.sealed_rig import OPEN, RIG_FILE
from hil.proof.work import WorkProgress, read_entries, work_on, write_entries

Row = dict[str, Any]

EXPERIMENTS = ("cruise", "reversal", "tip")

SCHEMA = "hil.wire/1"
RESULTS = "wire.json"

LIMIT_S = 600.0  # time one command may take [s]

STALE_SHARE: Final = 0.1

_READY = re.compile(r"ready bus=(?P<bus>\S+) modbus=(?P<modbus>\S+) commitment=(?P<commitment>[0-9a-f]{64})\n")

_END_S = 5.0  # time the process gets to end by itself once its input has ended [s]


@dataclass(frozen=True, slots=True)
class Concealed:
    """One rig."""

    where: str  # in words, for the scoreboard
    effect: str = "none"  # in the driveline, its sensor or its torque path
    faults: tuple[str, ...] = ()  # in the devices, as ``hil sim --fault`` takes them
    truth: Mapping[str, Any] = field(default_factory=dict)  # what the faults are to a diagnosis
    refused: str = ""  # word that must stand in the reason for which the tool refuses to drive


WIRED: Final[Mapping[str, Concealed]] = MappingProxyType(
    {
        "nothing": Concealed("nowhere: nothing is wrong"),
        "backlash": Concealed("the driveline: backlash", "backlash"),
        "dry_friction": Concealed("the driveline: dry friction at the motor", "coulomb_friction_motor"),
        "inverter_gain": Concealed(
            "an inverter's firmware: its torque is not what it reports", "inverter_gain_mismatch"
        ),
        "resolver_error": Concealed("the resolver: an error that goes round with the shaft", "resolver_error"),
        "stale_pdos": Concealed(
            "an inverter's firmware: PDOs that repeat old values",
            faults=(f"m1.stale_share={STALE_SHARE}",),
            truth={
                "effect": "stale_samples",
                "element": ["acquisition"],
                "hidden": {"stale_samples": {"every": 0.0, "share": STALE_SHARE}},
            },
        ),
        "delayed_torque": Concealed("an inverter's torque path: it acts late", "transport_delay"),
        "clutch_closed": Concealed(
            "the PLC: the clutch does not open", faults=("plc.clutch_closes@0",), refused="clutch"
        ),
    }
)
"""By name. A new rig is one entry."""


class SealedProcess:
    """A sealed rig that is up: its addresses and commitment, as in its ready line."""

    def __init__(self, process: subprocess.Popen[str], complaints: IO[bytes]) -> None:
        self._process: Any = process  # whose streams are pipes
        self._complaints = complaints
        line = self._answer()
        ready = _READY.fullmatch(line)
        if ready is None:
            raise RunAborted(f"sealed rig: expected 'ready bus=... modbus=... commitment=...', got {line!r}")
        self.bus, self.modbus, self.commitment = ready.group("bus", "modbus", "commitment")

    def open(self) -> object:
        """Have the seal opened; return it as read from JSON, to be verified against the commitment."""
        try:
            self._process.stdin.write(f"{OPEN}\n")
            self._process.stdin.flush()
        except BrokenPipeError as error:
            raise self._gone() from error
        return json.loads(self._answer())

    def _answer(self) -> str:
        line: str = self._process.stdout.readline()
        if not line:
            raise self._gone()
        return line

    def _gone(self) -> RunAborted:
        status = self._process.wait()
        self._complaints.seek(0)
        said = self._complaints.read().decode(errors="replace").strip() or "nothing"
        return RunAborted(f"sealed rig: expected an answer, but it ended with status {status}; it said: {said}")


@contextmanager
def sealed_process(*arguments: str) -> Iterator[SealedProcess]:
    """Serve a sealed rig in a process of its own, for the time of the block.

    It is in a session of its own: Ctrl-C at the terminal must reach the drives' master first, which then
    still has a rig to disarm. If this process dies, the end of its input ends the rig too.
    """
    with tempfile.TemporaryFile() as complaints, tempfile.TemporaryDirectory(prefix="hil-sealed-") as folder:
        process = start(
            python("-m", "hil.proof.sealed_rig", *arguments),
            cwd=folder,
            env=environment(),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=complaints,
            text=True,
        )
        try:
            yield SealedProcess(process, complaints)
        finally:
            _end(process)


def _end(process: Any) -> None:
    """End a process: by the end of its input, or by force if that is not heard."""
    with suppress(BrokenPipeError):  # what was still to be written to a process that is gone
        process.stdin.close()
    end(process, _END_S)


def rig_text(sealed: SealedProcess) -> str:
    """Return the text of the demo's rig file, at the addresses of a sealed rig."""
    document: Any = tomlkit.parse(RIG_FILE.read_text(encoding="utf-8"))
    host, _, port = sealed.modbus.rpartition(":")
    document["can"]["url"] = sealed.bus
    document["plc"]["host"], document["plc"]["port"] = host, int(port)
    return tomlkit.dumps(document)


def drive(name: str, concealed: Concealed, seed: int, out: Path) -> Row:
    """Drive one rig and judge what the tool makes of it."""
    arguments = ["--seed", str(seed), "--effect", concealed.effect]
    for fault in concealed.faults:
        arguments += ["--fault", fault]
    with tempfile.TemporaryDirectory(prefix="hil-rig-") as neutral:
        place = Path(neutral) / "rig"
        place.mkdir()
        with sealed_process(*arguments, "--model", str(place / "nominal.toml")) as sealed:
            (place / "rig.toml").write_text(rig_text(sealed), encoding="utf-8")
            answer = _work(place)
            truth = _truth(sealed, concealed)
        replace_own(out / name, place)
    about = {"case": name, "where": concealed.where, "said": answer.fault or ""}
    if concealed.refused:
        return {**about, **_refusal(concealed, seed, answer)}
    return {**score(kind(str(truth["effect"])), seed, truth, answer), **about}


def _work(place: Path) -> Answer:
    """Do what an engineer would do with a rig."""
    began = time.perf_counter()
    try:
        run_hil(["check", "rig.toml"], place, LIMIT_S)
        for name in EXPERIMENTS:
            run_hil(["run", "rig.toml", name, "--pace", "fast", "--out", f"{name}.csv"], place, LIMIT_S)
        recordings = [f"{name}.csv" for name in EXPERIMENTS]
        run_hil(["diagnose", *recordings, "--model", "nominal.toml", "--out", "."], place, LIMIT_S)
    except CommandFailed as failure:
        return Answer(None, diagnose_s=time.perf_counter() - began, fault=str(failure))
    diagnosis = json.loads(read_regular_text(place / "diagnosis.json"))
    return Answer(diagnosis, diagnose_s=time.perf_counter() - began)


def _truth(sealed: SealedProcess, concealed: Concealed) -> dict[str, Any]:
    return {**verify(sealed.commitment, sealed.open()), "events": {}, **concealed.truth}


def _refusal(concealed: Concealed, seed: int, answer: Answer) -> Row:
    right = answer.fault is not None and concealed.refused in answer.fault
    return {
        "kind": concealed.refused,
        "seed": seed,
        "outcome": "right" if right else "failed" if answer.fault else "drove all the same",
        "success": right,
        "fault": None if right else answer.fault,
        "diagnose_s": round(answer.diagnose_s, 2),
        "fresh_over_floor": [],
    }


def run_wire(out: Path, seed: int, names: Sequence[str], progress: WorkProgress) -> list[Row]:
    """Drive rigs, one after the other; returns their rows, also written to ``out/wire.json``."""
    for name in names:
        if name not in WIRED:
            raise UsageError(f"rig {name!r}: expected one of {', '.join(WIRED)}")
    kept = {row["case"]: row for row in read_rows(out)}
    known = {name: row for name, row in kept.items() if row["seed"] == seed and not row["fault"]}
    rows = work_on(
        names,
        lambda name: drive(name, WIRED[name], seed, out),
        progress,
        known=known,
        keep=lambda done: write_entries(out / RESULTS, SCHEMA, "rigs", list({**known, **done}.values())),
        said="driven",
    )
    return list(rows.values())


def read_rows(out: Path) -> list[Row]:
    """Return the rows that an earlier run has left; none where there was none."""
    path = out / RESULTS
    if not path.exists():
        return []
    rows = read_entries(path, SCHEMA, "rigs", "remove it")
    needed = {"case", "seed", "fault"}
    if not isinstance(rows, list) or not all(isinstance(row, dict) and needed <= set(row) for row in rows):
        raise UsageError(f"{path}: expected rigs, a list of rows with case, seed and fault; remove it")
    return rows
