"""Eight experiments on a road: a simulated rig on real protocol stacks, each with its own load, road and driver."""
