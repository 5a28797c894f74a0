"""Drivelines of the tests' form, drawn: 4 to 14 Hz, 2 to 10 % damping.

``responses``  the frequency response without a model against the exact one, from a PRBS and from a multi-sine
``joint``      one model of three recordings against each alone, and a fourth whose stiffness is 5 % higher
"""

from collections.abc import Iterator

import numpy as np
from scipy.signal import max_len_seq

from estimator.identification.best import BestEstimate, best_estimate
from estimator.identification.identify import VALUES_PER_WIDTH
from estimator.identification.joint import joint_estimate
from estimator.identification.spectral import spectral_estimate
from estimator.signals.decimate import high_passed
from estimator.signals.multisine import Lines, excited_lines, multisine_nm
from estimator.signals.record import FloatArray
from tests.benchmarks.ratios import table
from tests.estimator.identification.driveline import SAMPLE_TIME_S, Line, cruise

AMPLITUDE_NM = 60.0
PEAK_DB = 0.3
EXCITATIONS = {"PRBS, 30 s": (30.0, 0), "PRBS, 60 s": (60.0, 0), "multi-sine, 6 periods of 10 s": (60.0, 6)}


def drawn(seed: int) -> Line:
    """Draw a driveline."""
    rng = np.random.default_rng(seed)
    J_M, J_L = 1.6 * rng.uniform(0.7, 1.4), 100.0 * rng.uniform(0.5, 2.0)
    J, omega = J_M * J_L / (J_M + J_L), 2.0 * np.pi * rng.uniform(4.0, 14.0)
    return Line(k=J * omega**2, J_M=J_M, J_L=J_L, c=2.0 * rng.uniform(0.02, 0.1) * J * omega)


def exact(line: Line, frequency_hz: FloatArray) -> FloatArray:
    """Return the magnitude of the response of sampled motor speed to held motor torque."""
    Ad, Bd = line.discrete()
    z = np.exp(2j * np.pi * frequency_hz * SAMPLE_TIME_S)
    return np.array([abs(np.linalg.solve(at * np.eye(3) - Ad, Bd[:, 0])[0]) for at in z])


def _test_nm(seed: int, duration_s: float, periods: int) -> FloatArray:
    n = round(duration_s / SAMPLE_TIME_S)
    if periods:
        lines = excited_lines(n // periods, SAMPLE_TIME_S, 2.0, 25.0, Lines.ODD_RANDOM, seed)
        return np.resize(multisine_nm(n // periods, lines, AMPLITUDE_NM), n)
    state = np.random.default_rng(seed).permutation([1] * 6 + [0] * 6)
    return AMPLITUDE_NM * (2.0 * np.resize(max_len_seq(12, state=state)[0], n) - 1.0)


def responses_table(count: int) -> str:
    """Tell how often the bands hold the truth, and how far the peak is off."""
    rows = []
    for name, (duration_s, periods) in EXCITATIONS.items():
        held, off_db = [], []
        for seed in range(count):
            line = drawn(seed)
            record = cruise(seed, duration_s, line=line, test_nm=_test_nm(seed, duration_s, periods)).record
            found = spectral_estimate(high_passed(record), VALUES_PER_WIDTH)
            truth, size = exact(line, found.frequency_hz), np.abs(found.response)
            band = (found.frequency_hz > 3.0) & (found.frequency_hz < 20.0)
            held.append(np.mean(np.abs(size - truth)[band] <= 1.96 * found.magnitude_std[band]))
            near = np.abs(found.frequency_hz / line.resonance[0] - 1.0) < 0.3
            off_db.append(20.0 * np.log10(size[near].max() / truth[near].max()))
        within = np.mean(np.abs(off_db) < PEAK_DB)
        rows.append((name, f"{np.mean(held):.1%}", f"{np.mean(off_db):+.2f} dB", f"{within:.0%}"))
    return table(("torque", "bands hold", "peak, mean", f"peak within {PEAK_DB} dB"), rows)


def joint_table(count: int) -> str:
    """Tell how right one model of three recordings of 20 s is, and how often recordings are named as disagreeing."""
    single, joint, held, false, found = [], [], [], 0, 0
    for seed in range(count):
        line = drawn(seed)
        other = Line(k=1.05 * line.k, J_M=line.J_M, J_L=line.J_L, c=line.c)
        best = list(_fitted(seed, [line, line, line, other]))
        together, _ = joint_estimate("abc", best[:3])
        false += together is None or bool(together.disagreeing)
        four, _ = joint_estimate("abcd", best)
        found += four is not None and set(four.disagreeing) == {"d"}
        truth = line.resonance
        single += [_errors(each, truth) for each in best[:3]]
        if together is not None and together.mode is not None:
            mode = together.mode
            joint.append((mode.frequency_hz.value / truth[0] - 1.0, mode.damping.value / truth[1] - 1.0))
            held.append((mode.frequency_hz.covers(truth[0]), mode.damping.covers(truth[1])))
    covered = " / ".join(f"{share:.0%}" for share in np.mean(held, axis=0))
    rows = [
        ("each alone", *(f"{100 * each:.3f} %" for each in _rms(single)), ""),
        (
            "together",
            *(f"{100 * each:.3f} %" for each in _rms(joint)),
            covered,
        ),
    ]
    text = table(("model", "RMS error of frequency", "of damping", "95 % intervals hold"), rows)
    named = f"{false} named as disagreeing though of one line; {found} times the stiffer one named"
    return f"{text}\nOf {count}: {named}.\n"


def _fitted(seed: int, lines: list[Line]) -> Iterator[BestEstimate]:
    for number, line in enumerate(lines):
        test_nm = 0.5 * _test_nm(100 * seed + number, 20.0, 0)
        yield best_estimate(cruise(100 * seed + number, 20.0, 0.1, line=line, test_nm=test_nm).record)


def _errors(best: BestEstimate, truth: tuple[float, float]) -> tuple[float, float]:
    if best.mode is None:
        return float("nan"), float("nan")
    return best.mode.frequency_hz.value / truth[0] - 1.0, best.mode.damping.value / truth[1] - 1.0


def _rms(errors: list[tuple[float, float]]) -> FloatArray:
    return np.sqrt(np.nanmean(np.square(errors), axis=0))
