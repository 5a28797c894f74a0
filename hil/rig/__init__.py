"""The rig at work: devices from the rig file, the 10 ms cycle, experiments, sessions that always disarm."""
