"""What padasip's recursive least squares takes, in a Python of its own: its numpy need not be ours.

``python recursive_padasip.py DATA.npz``: regressors ``x`` (N, n) and outputs ``y`` (N,) of the file once through the
filter; writes the time taken, the processor time [s] and the last weights as JSON. Imports nothing of this project.
"""

import json
import sys
import time
from importlib import import_module

import numpy as np


def main(path: str) -> None:
    padasip = import_module("padasip")  # here, so that the benchmark can tell where this file is without having it

    with np.load(path) as data:
        x, y = data["x"], data["y"]
    rls = padasip.filters.FilterRLS(n=x.shape[1], mu=1.0, eps=0.001, w="zeros")  # R(0) = 1000 I
    clock, processor = time.perf_counter(), time.process_time()
    rls.run(y, x)
    taken = [time.perf_counter() - clock, time.process_time() - processor]
    sys.stdout.write(json.dumps({"taken_s": taken, "weights": rls.w.tolist()}))


if __name__ == "__main__":
    main(sys.argv[1])
