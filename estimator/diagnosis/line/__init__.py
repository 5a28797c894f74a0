"""The line of a fit, linearised and cut into blocks: what small torques do to it, and which would explain its error."""
