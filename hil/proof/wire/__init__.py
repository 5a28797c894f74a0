"""Effects concealed in a rig: served sealed, driven by the public command over CANopen and Modbus."""
