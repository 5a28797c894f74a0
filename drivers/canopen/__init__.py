"""The CAN bus and CANopen services (CiA 301).

What lives here: bus, SDO, PDO, heartbeat, EMCY, as bytes and integers. What may come in: `drivers.errors` and
`drivers.scaling`; nothing that knows what a drive is.
"""

from __future__ import annotations

import sys

if "can" not in sys.modules and "asammdf" not in sys.modules:
    # python-can imports asammdf and pandas, a second or two, for bus logs in MF4, of which nothing here makes use; with
    # this entry it takes them for not installed. So whoever needs `can` imports it from here.
    sys.modules["asammdf"] = None  # type: ignore[assignment]
    try:
        import can
    finally:
        del sys.modules["asammdf"]
else:
    import can

__all__ = ["can"]
