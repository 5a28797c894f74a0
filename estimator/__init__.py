"""Arrays in, results out: signals, identification, physics, diagnosis. No I/O, no clock, no bus."""
