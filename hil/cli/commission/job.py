"""The job of one call: the rig, what is known from earlier calls on its folder, and what its runs are driven under."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from hil.cli.options import Pace, pacer_for, scheduling
from hil.cli.run_progress import RunProgress
from hil.commission.engine import NAMES
from hil.commission.order import RigSource
from hil.commission.prbs_design import DEFAULT_TRAVEL_M_PER_RAD
from hil.commission.runner import Conditions, Runner
from hil.commission.state import State, StepRecord, load_state
from hil.commission.step import Job
from hil.config.model_file import read_model

if TYPE_CHECKING:
    from rich.console import Console


def job_in(
    folder: Path,
    source: RigSource,
    model: Path | None,
    trust_laws: bool,
    travel_m_per_rad: float | None,
    pace: Pace,
    console: Console,
) -> Job:
    """Make the job of a folder, with the state an earlier call has left there."""
    rig = source.rig()
    state = load_state(folder, NAMES) or State(
        folder, rig.name, str(source.path), source.text, {name: StepRecord() for name in NAMES}
    )
    conditions = Conditions(pace.value, lambda rig: pacer_for(rig, pace), lambda: scheduling(pace), RunProgress)
    return Job(
        source=source,
        rig=rig,
        state=state,
        runner=Runner(source, folder, conditions),
        nominal=None if model is None else read_model(model, trust_laws).model,
        travel_m_per_rad=DEFAULT_TRAVEL_M_PER_RAD if travel_m_per_rad is None else travel_m_per_rad,
        travel_is_given=travel_m_per_rad is not None,
        say=lambda line: console.print(line, markup=False, soft_wrap=not console.is_terminal),
        progress=lambda stage, share: None,
    )
