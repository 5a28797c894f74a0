"""What may go wrong between the sensor and the file: everything that happens to a recording after the physics."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Acquisition:
    """The chain from the resolver to the file; faultless at its defaults.

    Attributes
    ----------
    curvature : float
        Change of the speed's gain with speed: share that is missing at `readings.CURVATURE_SPEED_RAD_S`.
    sign_blind : bool
        The magnitude of the speed is read.
    grid_rad_s : float
        Step of the speed's number format [rad/s].
    count_rad, count_time_s : float
        Angle of an encoder's count, and the time over which counts are made to a speed.
    clock_error : float
        By how much more time passes between two speeds than between two torques, over the latter.
    jitter_s : float
        Greatest deviation of a speed's sampling instant from its time.
    stamps_told : bool
        Whether ``time_s`` has the true instants.
    stale_share, stale_most, stale_every : float
        Share of samples that begin a run of repeats, the longest run; or a repeat every so many samples.
    stale_rows : bool
        Whether torques are repeated with the speed.
    lost_share, lost_most : float
        Share of samples that begin a run of lost ones, the longest run.
    lost_m1, lost_m2, lost_speed : bool
        What is lost.
    lost_as_zero : bool
        Whether a lost sample is recorded as 0, without a flag.
    spike_share, spike_rad_s : float
        Share of the speeds with a wrong bit, and the greatest of these errors.
    """

    curvature: float = 0.0
    sign_blind: bool = False
    grid_rad_s: float = 0.0
    count_rad: float = 0.0
    count_time_s: float = 0.0
    clock_error: float = 0.0
    jitter_s: float = 0.0
    stamps_told: bool = False
    stale_share: float = 0.0
    stale_most: int = 1
    stale_every: int = 0
    stale_rows: bool = False
    lost_share: float = 0.0
    lost_most: int = 1
    lost_m1: bool = False
    lost_m2: bool = False
    lost_speed: bool = False
    lost_as_zero: bool = False
    spike_share: float = 0.0
    spike_rad_s: float = 0.0


FAULTLESS = Acquisition()
