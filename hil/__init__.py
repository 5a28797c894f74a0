"""The rig: configuration, cycle, experiments, simulated slaves, recordings, reports, command line."""

__version__ = "0.1.0"
