"""Puts the commit into every wheel and sdist: results of an installed copy name it (`hil.version`)."""

from __future__ import annotations

import runpy
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class CommitHook(BuildHookInterface):
    """Called by hatchling before it builds; see `[tool.hatch.build.hooks.custom]`."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Add ``hil/commit.txt``: the commit of this checkout, or of the sdist; none where unknown."""
        if version == "editable":  # runs from the checkout, whose commit changes
            return
        root = Path(self.root)
        known = runpy.run_path(str(root / "hil" / "version.py"))
        commit = known["_commit"]()
        if not commit or (root / "hil" / known["COMMIT_FILE"]).exists():
            return  # unknown; or the file of the sdist is taken as any other
        kept = root / "out" / "build" / known["COMMIT_FILE"]
        kept.parent.mkdir(parents=True, exist_ok=True)
        kept.write_text(commit + "\n", "ascii")
        build_data["force_include"][str(kept)] = f"hil/{known['COMMIT_FILE']}"
