"""A traction inverter in torque mode (CiA 402)."""
