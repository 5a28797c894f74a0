"""``hil demo``: the whole job with nothing connected, from a sealed effect to the opened seal."""

from __future__ import annotations

import json
import secrets
import shutil
import tempfile
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from hil.cli.options import hold
from hil.cli.printing import new_console

if TYPE_CHECKING:
    from rich.console import Console

    from estimator.diagnosis.result import Diagnosis
    from hil.config.rig_file import Rig
    from hil.proof.judge import Judgement
    from hil.proof.rigs import SealedProcess
    from hil.rig.check import DeviceFinding

SEEDS = 1_000_000
"""Seeds the demo draws from by itself: short enough to be typed again."""

EXPERIMENTS = ("cruise", "reversal", "tip")

SEAL, JUDGEMENT = "seal.json", "judgement.json"

app = typer.Typer(add_completion=False)


@app.command(epilog="Example: hil demo --seed 7 --out out/demo")
def demo(
    seed: Annotated[
        int | None,
        typer.Option(min=0, help="Seed of bus and effect; else at random, and printed."),
    ] = None,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder for report, recordings and opened seal.")] = Path(
        "out/demo"
    ),
) -> None:
    """Conceal an effect in a simulated rig, find it over CANopen and Modbus, then open the seal.

    The first run compiles for a minute or two more. The verdict is written before the seal is opened, and is judged
    unchanged.
    """
    hold(out)
    chosen = secrets.randbelow(SEEDS) if seed is None else seed
    with tempfile.TemporaryDirectory(prefix="hil-demo-") as workshop:
        _Demo(new_console(), chosen, Path(workshop), out).run()


class _Demo:
    """One pass: where it works, where its results go, what it says."""

    def __init__(self, console: Console, seed: int, workshop: Path, out: Path) -> None:
        self._console = console
        self._seed = seed
        self._workshop = workshop
        self._out = out
        self._nominal = workshop / "nominal.toml"
        self._rig_path = workshop / "rig.toml"

    def run(self) -> None:
        from hil.proof.rigs import sealed_process
        from hil.proof.seal import verify

        self._say(f"1/6 a bus with a concealed effect is drawn from seed {self._seed}, in a process of its own")
        with sealed_process("--seed", str(self._seed), "--model", str(self._nominal)) as sealed:
            self._say(f"    committed to the truth: SHA-256 {sealed.commitment}")
            verdict = self._work(sealed)
            self._say("6/6 the verdict is written; the seal is opened")
            opened = sealed.open()
        self._judge(verdict, verify(sealed.commitment, opened), opened, sealed.commitment)

    def _work(self, sealed: SealedProcess) -> dict[str, Any]:
        """Do what an engineer would do with a rig; return the content of diagnosis.json."""
        rig = self._rig(sealed)
        self._say(f"2/6 looking for the devices on {sealed.bus} and {sealed.modbus}")
        self._check(rig)
        self._say("3/6 driving the experiments")
        recordings = [self._record(rig, name) for name in EXPERIMENTS]
        self._say("4/6 identifying the driveline")
        self._identify(recordings[0])
        self._say("5/6 questioning the nominal model")
        return self._publish(self._diagnose(recordings), recordings)

    def _rig(self, sealed: SealedProcess) -> Rig:
        """Write the rig file with the addresses of this run, and read it as any command would."""
        from hil.config.rig_file import read_rig
        from hil.proof.rigs import rig_text

        self._rig_path.write_text(rig_text(sealed), encoding="utf-8")
        return read_rig(self._rig_path)

    def _check(self, rig: Rig) -> None:
        from drivers.errors import ConfigMismatch
        from hil.rig.check import DeviceVerdict, check_rig

        for finding in check_rig(rig):
            self._say(f"    {finding.device} at {finding.address}: {finding.verdict.value}")
            if finding.verdict is not DeviceVerdict.AGREES:
                raise ConfigMismatch(f"{finding.device}: {_faults(finding)}. The rig file is {self._rig_path}.")

    def _record(self, rig: Rig, name: str) -> Path:
        from hil.cli.run_job import run_progress
        from hil.recording import RecordingWriter
        from hil.rig.build import open_devices
        from hil.rig.metadata import run_metadata
        from hil.rig.pacing import FreePacer, device_patience_s, period_ns
        from hil.rig.plan import plan_run
        from hil.rig.session import run_plan
        from hil.rig.stop import StopRequest, stop_on_signals

        plan, stop = plan_run(rig, name), StopRequest()
        recorder = RecordingWriter(self._workshop / f"{name}.csv", run_metadata(self._rig_path, name))
        pacer = FreePacer(period_ns(rig.period_s))
        opened = open_devices(rig, device_patience_s(pacer))
        with stop_on_signals(stop), recorder, opened as devices, run_progress(plan) as progress:
            summary = run_plan(devices, plan, pacer, recorder, stop, progress)
        self._say(f"    {name}: {summary.recorded} samples, {summary.flagged} flagged")
        return recorder.path

    def _identify(self, recording: Path) -> None:
        from estimator.identification.identify import identify
        from hil.recording import read_record

        found = identify(read_record(recording))
        for how, mode in (("recursive (OEFO)", found.online_resonance), ("batch", found.batch_resonance)):
            if mode is None:
                self._say(f"    {how}: no lightly damped mode")
            else:
                self._say(f"    {how}: resonance {mode.frequency_hz:.2f} Hz, damping {mode.damping:.3f}")

    def _diagnose(self, recordings: list[Path]) -> Diagnosis:
        from estimator.diagnosis import diagnose
        from hil.cli.diagnose import progress_bar
        from hil.config.model_file import read_model
        from hil.recording import read_records

        model = read_model(self._nominal).model
        with progress_bar() as progress:
            return diagnose(read_records(recordings), model, (), progress)

    def _publish(self, diagnosis: Diagnosis, recordings: list[Path]) -> dict[str, Any]:
        """Write and print the verdict; a seal from an earlier run is not left next to it."""
        from hil.config.model_file import write_model
        from hil.provenance import provenance
        from hil.report.diagnosis_html import diagnosis_page, diagnosis_summary
        from hil.report.diagnosis_json import diagnosis_text
        from hil.result_folder import publish

        made = provenance([self._nominal], recordings)
        text, page = diagnosis_text(diagnosis, made), diagnosis_page(diagnosis, made)
        kept = {path.name: path for path in (*recordings, self._nominal, self._rig_path)}
        for name in (SEAL, JUDGEMENT):
            (self._out / name).unlink(missing_ok=True)
        publish(
            self._out,
            {
                **{name: partial(shutil.copyfile, path) for name, path in kept.items()},
                "diagnosis.json": lambda to: to.write_text(text, encoding="utf-8"),
                "augmented.toml": lambda to: write_model(to, diagnosis.augmented),
                "report.html": lambda to: to.write_text(page, encoding="utf-8"),
            },
        )
        self._console.print(diagnosis_summary(diagnosis))
        verdict: dict[str, Any] = json.loads(text)
        return verdict

    def _judge(self, verdict: dict[str, Any], truth: dict[str, object], opened: object, commitment: str) -> None:
        from hil.proof.judge import judge, judgement_text
        from hil.result_folder import publish

        judgement = judge(verdict, truth)
        seal = {"commitment": commitment, "opened": opened}
        result = _judgement_json(judgement, self._seed)
        publish(
            self._out,
            {
                SEAL: lambda to: to.write_text(json.dumps(seal, indent=2) + "\n", encoding="utf-8"),
                JUDGEMENT: lambda to: to.write_text(json.dumps(result, indent=2) + "\n", encoding="utf-8"),
            },
        )
        self._console.print(judgement_text(judgement, truth, commitment))
        self._say(f"report: {self._out / 'report.html'}    again: hil demo --seed {self._seed}")

    def _say(self, line: str) -> None:
        self._console.print(line, markup=False, highlight=False, soft_wrap=True)


def _faults(finding: DeviceFinding) -> str:
    differences = (f"{each.what}: expected {each.expected}, found {each.found}" for each in finding.differences)
    return "; ".join((*differences, *finding.notes))


def _judgement_json(judgement: Judgement, seed: int) -> dict[str, Any]:
    return {
        "schema": "hil.judgement/1",
        "seed": seed,
        "outcome": judgement.outcome.name.lower(),
        "hidden": list(judgement.hidden),
        "named": list(judgement.named),
        "sizes": [{**asdict(size), "inside": size.inside} for size in judgement.sizes],
    }
