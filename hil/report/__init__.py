"""Results for people and for scripts: ``diagnosis.json``, HTML pages, summaries on the terminal."""
