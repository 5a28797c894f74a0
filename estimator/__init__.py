"""Arrays in, results out: signals, identification, physics, diagnosis. No I/O, no clock, no bus.

Rooms and their order are in docs/architecture.md and checked by import-linter. What comes in: numpy arrays in SI units
with a mask, a nominal model, settings.
"""
