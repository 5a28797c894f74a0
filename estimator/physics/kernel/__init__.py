"""The compiled simulation: what moves, the laws at their places, one step, a whole recording."""
