"""From a linear model to what an engineer means: modes, their uncertainty, physical parameters."""
