"""The PLC on Modbus TCP, by a register map.

What lives here: register map, Modbus link, PLC. What may come in: `drivers.errors`, pymodbus and cryptography; no
CAN, no inverter.
"""
