"""What the steps read out of their recordings: arrays in, numbers with intervals out; no file, no bus."""
