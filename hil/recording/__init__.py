"""Recordings: reading and writing them in their formats, and turning them into what the estimator takes.

Read: file -> ``Table`` (columns, units, metadata) -> ``estimator.signals.record.Record`` by ``[signals]``.
Write: one ``Sample`` per cycle through ``RecordingWriter``, or a whole table by ``write_table``.
What may come in: files, `hil.sample`, `hil.problems`; no rig, no model.
"""

from hil.recording.formats import read_table
from hil.recording.publish import write_table
from hil.recording.recordings import read_records
from hil.recording.signals import read_record
from hil.recording.signals_config import SignalsConfig
from hil.recording.table import Table
from hil.recording.writer import RecordingWriter

__all__ = ["RecordingWriter", "SignalsConfig", "Table", "read_record", "read_records", "read_table", "write_table"]
