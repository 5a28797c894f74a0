"""Where simulation and recordings differ, and what is lacking there."""
