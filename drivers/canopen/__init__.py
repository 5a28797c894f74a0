"""The CAN bus and CANopen services (CiA 301).

What lives here: bus, SDO, PDO, heartbeat, EMCY, as bytes and integers. What may come in: `drivers.errors` and
`drivers.scaling`; nothing that knows what a drive is.
"""

from __future__ import annotations

import sys
from importlib import import_module

if "can" not in sys.modules and "asammdf" not in sys.modules:
    # python-can imports asammdf and pandas, a second or two, for bus logs in MF4, of which nothing here makes use; with
    # this entry it takes them for not installed.
    sys.modules["asammdf"] = None  # type: ignore[assignment]
    try:
        import_module("can")
    finally:
        del sys.modules["asammdf"]
