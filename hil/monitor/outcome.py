"""How a run went, in one line: on the screen, in the log, and in the terminal when the view is closed."""

from __future__ import annotations

from pathlib import Path

from hil.monitor.messages import Over


def outcome(over: Over) -> str:
    """Tell in one line how a run went; its file comes last, for its name may be long."""
    ended = "stopped by the operator" if over.stopped else "done"
    kept = "nothing recorded" if over.recording is None else _kept(over, over.recording)
    if over.reason is not None:
        return f"{over.experiment} ENDED EARLY: {over.reason.rstrip('.')} ({kept})"
    return f"{over.experiment} {ended}: {kept}"


def _kept(over: Over, recording: str) -> str:
    parts = [f"{over.samples} samples"]
    parts += [f"{over.flagged} flagged"] if over.flagged else []
    parts += [f"{over.alarms} {'ALARM' if over.alarms == 1 else 'ALARMS'}"] if over.alarms else []
    parts += [] if over.run_id is None else [f"run {over.run_id}"]
    return f"{', '.join(parts)}, {as_known(recording)}"


def as_known(path: str) -> str:
    """Name a file as a person in this folder would: from here on where it is inside, else whole."""
    here = Path.cwd()
    return str(Path(path).relative_to(here)) if Path(path).is_relative_to(here) else path
