"""What can be driven on the rig: a law for each kind, and a case for each in ``registry``."""
