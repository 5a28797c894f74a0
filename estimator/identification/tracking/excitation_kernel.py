"""Compiled: whether the torque excites the resonance, block by block; see :mod:`excitation` for the rule."""

from __future__ import annotations

from estimator.compiled import compiled
from estimator.identification.tracking.sensitivity_kernel import (
    LAST,
    output_density,
    pass_torque,
    sensitivity,
    weight_of,
)
from estimator.signals.record import FloatArray

# Places in `mode`: the resonance that was known last.
MODE_HZ = 0  # 0 before there was one
MODE_DAMPING, POLE_RE, POLE_IM, RHO_RE, RHO_IM = 1, 2, 3, 4, 5
N_MODE = 6

# Places in `block`: sums over the present block.
SAMPLES = 0
GOOD = 1  # samples that were good, with a mode
OUTPUT = 2  # over them: density of the torque's output at the peak, over that of the noise
TORQUE = 3  # square of the torque's step
N_BLOCK = 4

# Places in `lasting`: what outlasts a block.
VERDICT = 0
WEAK = 1  # 1 if the last block was below what is excitation
WITHIN = 2  # mean of TORQUE over the memory
USUAL = 3  # mean of TORQUE while excited; 0 before it ever was
N_LASTING = 4

# Verdicts, as in estimator.identification.tracking.excitation.Excitation.
_, EXCITED, LACKING, DROWNED = 0, 1, 2, 3


@compiled
def keep_mode(frequency_hz: float, damping: float, pole: complex, rho: complex, mode: FloatArray) -> None:
    """Keep a resonance that is known; the one before stays where the present estimate has none."""
    mode[MODE_HZ], mode[MODE_DAMPING] = frequency_hz, damping
    mode[POLE_RE], mode[POLE_IM], mode[RHO_RE], mode[RHO_IM] = pole.real, pole.imag, rho.real, rho.imag


@compiled
def take_torque(
    u: float, okay: bool, density: float, sample_time_s: float, mode: FloatArray, through: FloatArray, block: FloatArray
) -> None:
    """Take a sample into the block's densities of torque and output at the resonance."""
    pole = complex(mode[POLE_RE], mode[POLE_IM])
    block[SAMPLES] += 1.0
    if okay and mode[MODE_HZ] > 0.0:
        weight = weight_of(pole, complex(mode[RHO_RE], mode[RHO_IM]), mode[MODE_DAMPING], sample_time_s)
        psi = sensitivity(weight, through)
        block[GOOD] += 1.0
        block[OUTPUT] += output_density(psi, pole, mode[MODE_HZ] * mode[MODE_DAMPING]) / density
        block[TORQUE] += (u - through[LAST]) ** 2
    pass_torque(u, pole, through)


@compiled
def judge(memory: float, opens: float, closes: float, block: FloatArray, lasting: FloatArray) -> int:
    """Return the verdict on a block."""
    ratio, torque = block[OUTPUT] / block[GOOD], block[TORQUE] / block[GOOD]
    take_mean(torque, block[SAMPLES] / memory, WITHIN, lasting)
    was_excited, was_weak = lasting[VERDICT] == EXCITED, lasting[WEAK] == 1.0
    if ratio < opens and opens * torque < lasting[USUAL]:
        return LACKING
    weak = ratio < (closes if was_excited else opens)
    lasting[WEAK] = 1.0 if weak else 0.0
    if weak and not (was_excited and not was_weak):
        return DROWNED
    take_mean(torque, block[SAMPLES] / memory, USUAL, lasting)
    return EXCITED


@compiled
def take_mean(value: float, share: float, place: int, lasting: FloatArray) -> None:
    """Take a value into a mean with an exponential memory; the first is the mean."""
    if lasting[place] == 0.0:
        lasting[place] = value
    lasting[place] += share * (value - lasting[place])


@compiled
def end_block(memory: float, opens: float, closes: float, block: FloatArray, lasting: FloatArray) -> None:
    """Judge a whole block and begin the next; with few good samples, or no mode yet, the verdict stays as it is."""
    if 2.0 * block[GOOD] >= block[SAMPLES]:
        lasting[VERDICT] = judge(memory, opens, closes, block, lasting)
    block[:] = 0.0


@compiled
def forgotten(lasting: FloatArray) -> float:
    """Return how many times more the torque said while excited than within the memory; 1 at least."""
    if lasting[USUAL] <= lasting[WITHIN]:
        return 1.0
    return float(lasting[USUAL] / lasting[WITHIN])
