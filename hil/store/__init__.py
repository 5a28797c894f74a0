"""The store of runs: what was run with what and what came of it, in ``runs.sqlite`` next to the recordings.

The recordings stay the source: each explains itself, and the store can be made again from them. What may come in:
recordings' metadata (`hil.recording`), results as JSON.
"""

from hil.store.entry import Attachment, Note, Run, RunEntry
from hil.store.filters import RunFilter
from hil.store.register import entry_of, register_run
from hil.store.results import attach_to_runs
from hil.store.run_store import STORE_NAME, RunStore, store_of

__all__ = [
    "STORE_NAME",
    "Attachment",
    "Note",
    "Run",
    "RunEntry",
    "RunFilter",
    "RunStore",
    "attach_to_runs",
    "entry_of",
    "register_run",
    "store_of",
]
