"""Which runs are asked for."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

_SEARCHED = (
    "runs.experiment",
    "runs.recording",
    "runs.outcome",
    "runs.software_version",
    "(SELECT text FROM rig_files WHERE sha256 = runs.rig_sha256)",
    "(SELECT group_concat(text, char(10)) FROM notes WHERE run_id = runs.id)",
    "(SELECT group_concat(document, char(10)) FROM attachments WHERE run_id = runs.id)",
)

VERDICT = """(SELECT CASE WHEN json_valid(document) THEN json_extract(document, '$.verdict') END
    FROM attachments WHERE run_id = runs.id AND kind = 'diagnosis' ORDER BY id DESC LIMIT 1)"""
"""The verdict of a run's last diagnosis, as an SQL expression."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RunFilter:
    """All that is given must hold; nothing given: every run.

    Attributes
    ----------
    experiment : str
        Name of the experiment.
    since, until : str
        Start of the run: ISO 8601 date or time in UTC, `since` included, `until` included to its last digit
        (``2026-11-21`` is the whole day).
    rig : str
        Name of the rig, or the beginning of its rig file's SHA-256.
    verdict : str
        Of the last diagnosis.
    text : str
        Somewhere in experiment, recording's name, outcome, version, rig file, notes or attached documents, capitals
        or not.
    """

    experiment: str = ""
    since: str = ""
    until: str = ""
    rig: str = ""
    verdict: str = ""
    text: str = ""

    def where(self) -> tuple[str, list[Any]]:
        """Return an SQL condition on ``runs``, and its arguments."""
        parts: list[tuple[str, list[Any]]] = []
        if self.experiment:
            parts.append(("runs.experiment = ?", [self.experiment]))
        if self.since:
            parts.append(("runs.started_utc >= ?", [self.since]))
        if self.until:
            parts.append(("runs.started_utc <> '' AND substr(runs.started_utc, 1, length(?)) <= ?", [self.until] * 2))
        if self.rig:
            named = (
                "runs.rig_sha256 IN (SELECT sha256 FROM rig_files WHERE name = ? OR substr(sha256, 1, length(?)) = ?)"
            )
            parts.append((named, [self.rig] * 3))
        if self.verdict:
            parts.append((f"{VERDICT} = ?", [self.verdict]))
        if self.text:
            anywhere = " OR ".join(f"instr(lower(coalesce({where}, '')), lower(?)) > 0" for where in _SEARCHED)
            parts.append((f"({anywhere})", [self.text] * len(_SEARCHED)))
        return " AND ".join(part for part, _ in parts) or "1", [value for _, values in parts for value in values]
