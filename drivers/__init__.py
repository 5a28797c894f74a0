"""Speak to devices: CANopen inverters and the Modbus PLC. No physics, no estimation."""
