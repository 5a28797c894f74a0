"""Other tools on the same arrays: high-passed, 10 ms, third order, as two masses have.

==============  ===========================================================================================
sippy_unipi     SIPPY of G. Armenise, R. Bacci di Capaci, M. Vaccari and G. Pannocchia (Pisa): N4SID and, made for
                closed loops, PARSIM-K; horizons of 20 samples by default (``sippy`` on PyPI is something else)
nfoursid        PO-MOESP and N4SID of S. van Gemert; its documentation leaves the block rows to the user: 20 as SIPPY
control         python-control: Markov parameters by least squares, then the eigensystem realisation
scipy           Box-Jenkins with a noise model of order 50, in thirty lines
==============  ===========================================================================================

statsmodels is left out: its regressions with ARMA errors have no transfer function of the input, SysIdentPy too: its
linear models are ARX, whose poles the noise of the speed shifts by per cents.
"""

from __future__ import annotations

import contextlib
import importlib
import importlib.util
import io
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tests.benchmarks.buses.drive import PERIOD_S
from tests.benchmarks.buses.line import Array
from tests.benchmarks.identification.answer import Answer, Case, of_poles
from tests.benchmarks.identification.box_jenkins import ORDER, box_jenkins

HORIZON = 20
"""Block rows of the subspace methods [samples]: SIPPY's default, a period of the slowest resonance."""

MARKOV = 200
"""Parameters of the impulse response: 2 s, in which the least damped resonance has died."""

Poles = Callable[[Array, Array], Array]


@dataclass(frozen=True, slots=True)
class Peer:
    """A method of a tool: its name in the table, what to import, what to install, and how it is called."""

    name: str
    module: str
    requirement: str
    poles: Poles

    @property
    def is_installed(self) -> bool:
        """Tell whether it can be run here."""
        return importlib.util.find_spec(self.module) is not None

    def __call__(self, case: Case) -> Answer:
        """Identify one bus; what it prints by the way is dropped."""
        with contextlib.redirect_stdout(io.StringIO()):
            try:
                return of_poles(self.poles(case.u.copy(), case.y.copy()))
            except (ArithmeticError, IndexError, ValueError, np.linalg.LinAlgError) as error:
                return Answer(refusal=f"{type(error).__name__}: {error}")


def sippy(method: str) -> Poles:
    """Return a subspace method of SIPPY."""

    def poles(u: Array, y: Array) -> Array:
        identify = importlib.import_module("sippy_unipi").system_identification
        return np.linalg.eigvals(identify(y, u, method, tsample=PERIOD_S, SS_fixed_order=ORDER).A)

    return poles


def nfoursid(u: Array, y: Array) -> Array:
    """Return the poles of nfoursid's model."""
    table = importlib.import_module("pandas").DataFrame({"torque": u, "speed": y})
    tool = importlib.import_module("nfoursid.nfoursid")
    method = tool.NFourSID(table, output_columns=["speed"], input_columns=["torque"], num_block_rows=HORIZON)
    method.subspace_identification()
    return np.linalg.eigvals(method.system_identification(rank=ORDER)[0].a)


def eigensystem(u: Array, y: Array) -> Array:
    """Return the poles of python-control's realisation."""
    control = importlib.import_module("control")
    impulse = np.ravel(control.markov(y, u, MARKOV, dt=PERIOD_S))
    rows = MARKOV // 2 - 1
    return np.linalg.eigvals(control.eigensys_realization(impulse, ORDER, m=rows, n=rows, dt=PERIOD_S)[0].A)


SIPPY, NFOURSID, CONTROL, SCIPY = "sippy_unipi==1.0.1", "nfoursid==1.0.2", "control==0.10.2", "scipy"

REFERENCE = "SIPPY: N4SID"
"""Processor times are reported as ratios to this one's."""

PEERS = (
    Peer(REFERENCE, "sippy_unipi", SIPPY, sippy("N4SID")),
    Peer("SIPPY: PARSIM-K", "sippy_unipi", SIPPY, sippy("PARSIM-K")),
    Peer("nfoursid: N4SID", "nfoursid", NFOURSID, nfoursid),
    Peer("python-control: ERA", "control", CONTROL, eigensystem),
    Peer("scipy: Box-Jenkins, AR(50)", "scipy", SCIPY, box_jenkins),
)
