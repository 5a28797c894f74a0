"""Figures of results, drawn in a notebook and in every page that is made of it, without a network."""

from __future__ import annotations

import json
from typing import Any

import plotly.graph_objects as go

from hil.report.page import plotly_bundle


class Drawn(go.Figure):  # type: ignore[misc]  # plotly has no types
    """A figure that brings what draws it: plotly's own output is empty once nbconvert has made a page of it."""

    def _repr_mimebundle_(self, *_: Any, **__: Any) -> dict[str, Any]:
        drawing = self.to_html(full_html=False, include_plotlyjs=False)
        return {
            "application/vnd.plotly.v1+json": json.loads(self.to_json()),
            "text/html": f"<script>{plotly_bundle()}</script>{drawing}",
        }

    def _ipython_display_(self) -> None:
        from IPython.display import display  # type: ignore[import-not-found]  # a notebook has it

        display(self._repr_mimebundle_(), raw=True)
