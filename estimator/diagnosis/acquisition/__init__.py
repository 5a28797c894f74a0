"""Faults of the acquisition, recognised in the raw recordings and compensated, so that mechanics can be judged."""
