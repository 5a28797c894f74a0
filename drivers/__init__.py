"""Speak to devices: CANopen inverters and the Modbus PLC. No physics, no estimation.

Rooms and their order are in docs/architecture.md and checked by import-linter. What comes in: settings, EDS files and
register maps, frames with their arrival times. Nothing of ``estimator`` or ``hil``.
"""
