"""Alarms of the on-line estimate, as a run's ``.online.json`` has them (`hil.rig.live_course`)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from estimator.identification.tracking.alarm import Alarm

COUNT = """(SELECT CASE WHEN json_valid(document) THEN (SELECT count(*) FROM json_each(document, '$.alarms')
        WHERE CASE WHEN type = 'object' THEN
            json_extract(value, '$.settled') OR key = json_array_length(document, '$.alarms') - 1 END) END
    FROM attachments WHERE run_id = runs.id AND kind = 'online' ORDER BY id DESC LIMIT 1)"""
"""How many changes the last on-line estimate of a run found, as an SQL expression; counts as `found_changes` does."""


def found_changes(document: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the alarms of a course, one for each change: one that came before it had settled comes once more."""
    alarms = document.get("alarms")
    rows = [alarm for alarm in alarms if isinstance(alarm, dict)] if isinstance(alarms, list) else []
    return [alarm for number, alarm in enumerate(rows) if alarm.get("settled") or number == len(rows) - 1]


def statements(document: Mapping[str, Any]) -> list[str]:
    """Return a line for each change of a course; of one that another program wrote otherwise, what stands there."""
    lines = []
    for row in found_changes(document):
        try:
            lines.append(Alarm.from_json(row).statement)
        except (KeyError, TypeError, ValueError, ZeroDivisionError):
            lines.append(f"not as this program writes it: {row}")
    return lines
