"""A traction inverter in torque mode (CiA 402).

What lives here: states, set-up, feedback, watching and stopping of one drive. What may come in: all rooms of drivers
but ``plc``; a torque only as the result of `drivers.torque_guard`.
"""
