"""What can be driven on the rig: one file each, and one line each in ``registry``."""
