"""Simulated slaves on the real protocol stacks; what models a device is stepped and reads no clock.

What lives here: inverters, PLC and driveline, their faults, and the server for another process. What may come in: a rig
file, SYNC and frames; time is counted in SYNCs.
"""
