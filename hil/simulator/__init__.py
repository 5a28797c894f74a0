"""Simulated slaves on the real protocol stacks; what models a device is stepped and reads no clock."""
