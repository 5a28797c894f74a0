"""The steps of a commissioning: one file each, and one line each in ``hil.commission.engine``."""
