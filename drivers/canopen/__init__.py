"""The CAN bus and CANopen services (CiA 301).

What lives here: bus, SDO, PDO, heartbeat, EMCY, as bytes and integers. What may come in: `drivers.errors` and
`drivers.scaling`; nothing that knows what a drive is.
"""
