"""How Sphinx builds these pages: ``sphinx-build -W --keep-going -b html docs out/docs``.

The pages are Markdown that reads as well where it is stored; only the API is taken out of the source. Nothing is
fetched while building or reading: no inventories of other projects, no fonts.
"""

from __future__ import annotations

import sys
from importlib.metadata import version as version_of
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

project = "hil"
author = "the hil developers"
copyright = "the hil developers, Apache-2.0"
release = version = version_of("hil-driveline")

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
exclude_patterns: list[str] = []

smartquotes = False
"""Options are shown as they are typed: ``--json``, not with a dash."""

myst_heading_anchors = 4
"""Headings are reached by the fragments that Git hosts give them, as tests/docs/test_links.py reckons them."""

autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented_params"
napoleon_google_docstring = False
napoleon_use_rtype = False

html_theme = "furo"
html_title = "hil"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sphinx = False
