"""The list of runs: what was run with what and what came of it, in the folder ``hil_runs`` next to the recordings.

The recordings are the source: each explains itself, and the list can be made again from them.
"""

from hil.store.entry import Attachment, Note, Run, RunEntry, entry_at
from hil.store.rebuild import attach_to_runs, register_run
from hil.store.run_store import STORE_NAME, RunFilter, RunStore, store_of

__all__ = [
    "STORE_NAME",
    "Attachment",
    "Note",
    "Run",
    "RunEntry",
    "RunFilter",
    "RunStore",
    "attach_to_runs",
    "entry_at",
    "register_run",
    "store_of",
]
