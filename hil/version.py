"""The version of this program, as results and recordings carry it."""

__version__ = "0.2.0"
