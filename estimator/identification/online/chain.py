"""The on-line chain: samples of the bus in, the driveline's model and its resonance out, while driving.

::

    torque, output  ->  high-pass, low-pass, every M-th sample   (estimator.signals.decimate)
                    ->  recursive estimator                      (Oefo, or any other)
                    ->  poles, resonance, damping                (tracking.resonance)

One code for a sample and for a block: what a rig computed while driving comes out of its recording again, to the
bit. Nothing in the loop raises on a value; the estimate's status says what is wrong with it.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from estimator.errors import BadSetting, BadShape
from estimator.identification.excitation import SAMPLES_PER_PARAMETER
from estimator.identification.identify import Settings
from estimator.identification.online.oefo import Filtering, Oefo
from estimator.identification.online.online_estimate import OnlineEstimate, OnlineTrajectory
from estimator.identification.online.recursive import RecursiveEstimator
from estimator.identification.tracking.resonance import resonances
from estimator.signals.decimate import Decimator
from estimator.signals.record import BoolArray, FloatArray, Record

EstimatorFactory = Callable[[Settings, FloatArray | None], RecursiveEstimator]
"""Makes a recursive estimator from the settings and L (None: there is no batch model yet)."""


def oefo(settings: Settings, L: FloatArray | None) -> Oefo:
    """Make the paper's estimator; without L the filter follows the present A_hat (AFOLOE)."""
    if L is not None:
        return settings.estimator(L)
    start_up = SAMPLES_PER_PARAMETER * settings.orders.n_parameters
    return Oefo(np.ones(1), settings.orders, settings.adaptation, Filtering.ADAPTED, start_up)


class OnlineChain:
    """The chain with its state; memory does not grow.

    Parameters
    ----------
    settings : Settings
        As for a recording; ``samples`` does not end it.
    sample_time_s : float
        Sampling period of what will come [s]; ``settings.sample_time_s`` is a whole multiple of it.
    L : ndarray, optional
        Observation filter's denominator, from a batch model of an earlier run. None: there is none yet, and
        the filter follows the estimate.
    estimator : callable, optional
        Makes another recursive estimator than OEFO.

    Raises
    ------
    BadSetting
        If the models' period is no whole multiple of the samples'.
    """

    def __init__(
        self,
        settings: Settings,
        sample_time_s: float,
        L: FloatArray | None = None,
        estimator: EstimatorFactory = oefo,
    ) -> None:
        self.settings = settings
        factor = _factor(settings, sample_time_s)
        self._decimator = Decimator(sample_time_s, factor, settings.high_pass_hz)
        self._estimator = estimator(settings, L)
        self._seen = 0
        self._factor = factor
        self._one = (np.zeros(1), np.zeros(1), np.zeros(1), np.zeros(1, dtype=np.bool_))

    @property
    def delay_s(self) -> float:
        """How long after its moment an estimate comes: the delay of the low-pass [s]."""
        return self._decimator.delay_samples * self._decimator.sample_time_s

    def push(self, time_s: float, torque_nm: float, output: float, okay: bool = True) -> OnlineEstimate | None:
        """Take one sample.

        Parameters
        ----------
        time_s : float
            Its moment [s].
        torque_nm : float
            Total torque [Nm].
        output : float
            Speed, or whatever the output is [rad/s].
        okay : bool
            False masks it.

        Returns
        -------
        OnlineEstimate or None
            None where the decimation keeps nothing of this sample.
        """
        times, torques, outputs, mask = self._one
        times[0], torques[0], outputs[0], mask[0] = time_s, torque_nm, output, okay
        kept = self.run_block(times, torques, outputs, mask)
        return kept[0] if len(kept) else None

    def run(self, record: Record) -> OnlineTrajectory:
        """Take a whole recording, with the same bits as sample by sample.

        Where no torque had been read yet the torque is passed on as missing: a rig can not look ahead.
        """
        torque_nm = record.total_torque_nm
        unread = np.logical_and.accumulate(~record.torque_trusted.all(axis=1))
        return self.run_block(record.time_s, np.where(unread, np.nan, torque_nm), record.output, record.okay)

    def run_block(
        self, time_s: FloatArray, torque_nm: FloatArray, output: FloatArray, okay: BoolArray
    ) -> OnlineTrajectory:
        """Take a block of samples, each array of shape (N,); see :meth:`push`.

        Raises
        ------
        BadShape
            If the arrays do not have one shape (N,).
        """
        if time_s.shape != torque_nm.shape:
            raise BadShape(
                f"on-line chain: time_s and torque_nm have the shapes {time_s.shape} and {torque_nm.shape}, expected "
                "one shape (N,). Give every signal one value per sample."
            )
        kept = self._decimator.run(torque_nm, output, okay)
        times = time_s[-self._seen % self._factor :: self._factor] - self.delay_s
        self._seen = (self._seen + time_s.shape[0]) % self._factor
        estimates = self._estimator.run(kept.u, kept.y, kept.okay)
        orders, period_s = self._estimator.orders, self._decimator.sample_time_s
        found = resonances(estimates, orders, period_s, self.settings.band_hz)
        unknown = np.full(len(estimates), np.nan)
        return OnlineTrajectory(
            time_s=times,
            estimates=estimates,
            frequency_hz=found[0],
            damping=found[1],
            height=found[2],
            frequency_std_hz=unknown,
            damping_std=unknown,
            alarms=(),
            alarm_at=(),
            orders=orders,
            sample_time_s=period_s,
        )


def _factor(settings: Settings, sample_time_s: float) -> int:
    ratio = settings.sample_time_s / sample_time_s if sample_time_s > 0 else 0.0
    factor = round(ratio)
    if factor < 1 or abs(ratio - factor) > 1e-3 * ratio:
        raise BadSetting(
            f"on-line chain: samples come every {sample_time_s:g} s, expected a whole fraction of the models' period "
            f"{settings.sample_time_s:g} s. Choose another period for the models."
        )
    return factor
