"""Recursive estimators: one sample at a time on the rig, or a recording as a block, with equal bits."""
