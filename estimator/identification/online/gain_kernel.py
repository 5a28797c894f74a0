"""Compiled: the adaptation gain F of every recursive estimator here, and how a sample changes it.

F is kept as U D U^T (U unit upper triangular, D diagonal) and updated after G. J. Bierman, Factorization Methods
for Discrete Sequential Estimation (Academic Press, 1977), chapter V: F can then not lose symmetry or turn
indefinite by rounding, however long the run, which the plain update of equation (5) does.

Row j of the array ``U`` is *column* j of U, with its unit diagonal and the zeros below it: so the inner loops run
over whole rows of fixed length, which a compiler turns into vector instructions; the zeros change no value.
"""

from __future__ import annotations

from estimator.compiled import borrowing
from estimator.signals.record import FloatArray

# Places in `law`, see GainLaw.as_array.
INITIAL_GAIN, LAMBDA1, LAMBDA0, LAMBDA2, TRACE, ALPHA, HOLDS_AT_ONCE = range(7)

# Places in `live` that belong to the gain.
LAMBDA1_NOW = 0
HOLDS_TRACE = 1  # 1 while tr F is held

INFORMATION_GAIN = 1000.0  # start of the gain that tells what the samples determine, where F itself can't


@borrowing
def dot(a: FloatArray, b: FloatArray) -> float:
    """Return a^T b; a plain loop, since calling a library takes longer than eight products."""
    total = 0.0
    for i in range(a.shape[0]):
        total += a[i] * b[i]
    return total


@borrowing
def project(Phi: FloatArray, U: FloatArray, f: FloatArray) -> None:
    """Set f = U^T Phi."""
    for j in range(Phi.shape[0]):
        total = Phi[j]
        for i in range(j):
            total += U[j, i] * Phi[i]
        f[j] = total


@borrowing
def gain(Phi: FloatArray, U: FloatArray, D: FloatArray, g: FloatArray, f: FloatArray) -> float:
    """Set g = F Phi and return Phi^T F Phi."""
    n = Phi.shape[0]
    project(Phi, U, f)
    s = 0.0
    for i in range(n):
        g[i] = 0.0
    for j in range(n):
        v = D[j] * f[j]
        s += f[j] * v
        for i in range(n):
            g[i] += U[j, i] * v
    return s


@borrowing
def absorb(Phi: FloatArray, ratio: float, U: FloatArray, D: FloatArray, g: FloatArray, f: FloatArray) -> float:
    """Take Phi into the factors, F - F Phi Phi^T F / (ratio + Phi^T F Phi); g and the result as of :func:`gain`."""
    n = Phi.shape[0]
    project(Phi, U, f)
    s = 0.0
    before = ratio
    weight = 1.0 / before
    for i in range(n):
        g[i] = 0.0
    for j in range(n):
        v = D[j] * f[j]
        s += f[j] * v
        after = before + f[j] * v
        share = f[j] * weight
        weight = 1.0 / after
        D[j] *= before * weight
        for i in range(n):
            u_ij = U[j, i]
            U[j, i] = u_ij - g[i] * share
            g[i] += u_ij * v
        before = after
    return s


@borrowing
def diagonal(U: FloatArray, D: FloatArray, diag: FloatArray) -> float:
    """Set diag = diag F and return tr F."""
    n = D.shape[0]
    for i in range(n):
        diag[i] = 0.0
    for j in range(n):
        for i in range(n):
            diag[i] += U[j, i] * U[j, i] * D[j]
    trace = 0.0
    for i in range(n):
        trace += diag[i]
    return trace


@borrowing
def scale_of(trace: float, law: FloatArray, live: FloatArray, n: int) -> float:
    """Return what F is multiplied by after a sample was absorbed: 1 / lambda_1, as the profile has it."""
    if live[HOLDS_TRACE] == 1.0:
        return float(law[TRACE] / trace)
    if trace <= live[LAMBDA1_NOW] * law[INITIAL_GAIN] * n:
        return float(1.0 / live[LAMBDA1_NOW])
    return 1.0  # without excitation nothing is forgotten: F would grow beyond every bound


@borrowing
def learn(
    Phi: FloatArray,
    law: FloatArray,
    live: FloatArray,
    U: FloatArray,
    D: FloatArray,
    diag: FloatArray,
    g: FloatArray,
    f: FloatArray,
) -> float:
    """Update F by equation (5) with the lambdas of the profile; g = F Phi and Phi^T F Phi are of the F before."""
    n = D.shape[0]
    s = absorb(Phi, law[ALPHA] if live[HOLDS_TRACE] == 1.0 else live[LAMBDA1_NOW], U, D, g, f)
    trace = diagonal(U, D, diag)
    scale = scale_of(trace, law, live, n)
    for i in range(n):
        D[i] *= scale
        diag[i] *= scale
    live[LAMBDA1_NOW] = law[LAMBDA0] * live[LAMBDA1_NOW] + 1.0 - law[LAMBDA0]
    if trace * scale <= law[TRACE]:
        live[HOLDS_TRACE] = 1.0
    return s


@borrowing
def informs_by_itself(law: FloatArray) -> bool:
    """Tell whether diag F falls as the samples determine more; a constant gain and a constant trace do not."""
    return bool(law[LAMBDA2] != 0.0 and law[HOLDS_AT_ONCE] == 0.0)


@borrowing
def adapt(
    Phi: FloatArray,
    law: FloatArray,
    live: FloatArray,
    U: FloatArray,
    D: FloatArray,
    known_U: FloatArray,
    known_D: FloatArray,
    diag: FloatArray,
    g: FloatArray,
    f: FloatArray,
) -> float:
    """Update whatever the profile has; g = F Phi and Phi^T F Phi are of the F before.

    ``diag`` then tells what the samples determine: it is that of F, or, where F does not fall with them, that of
    the decreasing gain ``known_U``, ``known_D`` that runs beside it for this alone.
    """
    if informs_by_itself(law):
        return learn(Phi, law, live, U, D, diag, g, f)
    absorb(Phi, 1.0, known_U, known_D, g, f)
    if law[LAMBDA2] == 0.0:
        s = gain(Phi, U, D, g, f)
    else:
        s = learn(Phi, law, live, U, D, diag, g, f)
    diagonal(known_U, known_D, diag)
    return s
