"""Results for people and for scripts: ``diagnosis.json``, HTML pages, summaries on the terminal.

What lives here: figures, wording, pages, files written whole or not at all. What may come in: results; nothing is
computed here that a verdict rests on.
"""
