"""Signals: what was recorded, and the excitation that made it."""
