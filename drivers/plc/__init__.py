"""The PLC on Modbus TCP, by a register map."""
