"""Electronic data sheets (CiA 306), as they are written.

What lives here: EDS files as text, numbers, objects, and what drivers ask of them. What may come in: a path, and the
PDO layouts of `drivers.canopen`; whether a file is any good is judged in `drivers.eds_check`.
"""

import drivers.canopen as drivers_canopen  # noqa: F401 - before canopen, see there
