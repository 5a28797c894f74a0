"""The rig at work: devices from the rig file, the 10 ms cycle, experiments, sessions that always disarm.

What lives here: `build` (the only module that chooses real or simulated devices), cycle, experiments, stop, replay.
What may come in: a rig file, drivers, simulator; a torque leaves through `drivers.torque_guard` alone.
"""
