"""``hil monitor``: a rig, watched and driven from a terminal.

Two processes share the work. One has the rig: it cycles, records, arms and disarms (`host`). The other has the
terminal: it estimates and draws (`app`). Between them go `messages`, both ways; drawing takes the interpreter for
milliseconds, and in one process it would delay the cycle.
"""
