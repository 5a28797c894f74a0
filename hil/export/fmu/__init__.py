"""``hil export fmu``: a driveline as a functional mock-up unit, FMI 2.0 or 3.0, for other simulations."""
