"""Compiled: the adaptation gain F of every recursive estimator here, and how a sample changes it.

F is kept as U D U^T (U unit upper triangular, D diagonal) and updated after G. J. Bierman, Factorization Methods
for Discrete Sequential Estimation (Academic Press, 1977), chapter V: F can then not lose symmetry or turn
indefinite by rounding, however long the run, which the plain update of equation (5) does.

Row j of the array ``U`` is *column* j of U, with its unit diagonal and the zeros below it: so the inner loops run
over whole rows of fixed length, which a compiler turns into vector instructions; the zeros change no value.
"""

from __future__ import annotations

from estimator.compiled import inlined
from estimator.identification.online.memory import Parts
from estimator.signals.record import FloatArray

# Places in `law`, see GainLaw.as_array.
INITIAL_GAIN, LAMBDA1, LAMBDA0, LAMBDA2, TRACE, ALPHA, HOLDS_AT_ONCE = range(7)

# Places in `live` that belong to the gain.
LAMBDA1_NOW = 0
HOLDS_TRACE = 1  # 1 while tr F is held

INFORMATION_GAIN = 1000.0  # start of the gain that tells what the samples determine, where F itself can't


@inlined
def dot(a: FloatArray, b: FloatArray) -> float:
    """Return a^T b; a plain loop, since calling a library takes longer than eight products."""
    total = 0.0
    for i in range(a.shape[0]):
        total += a[i] * b[i]
    return total


@inlined
def project(Phi: FloatArray, U: FloatArray, f: FloatArray) -> None:
    """Set f = U^T Phi."""
    for j in range(Phi.shape[0]):
        total = Phi[j]
        for i in range(j):
            total += U[j, i] * Phi[i]
        f[j] = total


@inlined
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


@inlined
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


@inlined
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


@inlined
def scale_of(trace: float, m: Parts) -> float:
    """Return what F is multiplied by after a sample was absorbed: 1 / lambda_1, as the profile has it."""
    if m.live[HOLDS_TRACE] == 1.0:
        return float(m.law[TRACE] / trace)
    if trace <= m.live[LAMBDA1_NOW] * m.law[INITIAL_GAIN] * m.D.shape[0]:
        return float(1.0 / m.live[LAMBDA1_NOW])
    return 1.0  # without excitation nothing is forgotten: F would grow beyond every bound


@inlined
def learn(Phi: FloatArray, m: Parts) -> float:
    """Update F by equation (5) with the lambdas of the profile; g = F Phi and Phi^T F Phi are of the F before."""
    live, law = m.live, m.law
    s = absorb(Phi, law[ALPHA] if live[HOLDS_TRACE] == 1.0 else live[LAMBDA1_NOW], m.U, m.D, m.g, m.f)
    trace = diagonal(m.U, m.D, m.diagonal)
    scale = scale_of(trace, m)
    for i in range(m.D.shape[0]):
        m.D[i] *= scale
        m.diagonal[i] *= scale
    live[LAMBDA1_NOW] = law[LAMBDA0] * live[LAMBDA1_NOW] + 1.0 - law[LAMBDA0]
    if trace * scale <= law[TRACE]:
        live[HOLDS_TRACE] = 1.0
    return s


@inlined
def informs_by_itself(law: FloatArray) -> bool:
    """Tell whether diag F falls as the samples determine more; a constant gain and a constant trace do not."""
    return bool(law[LAMBDA2] != 0.0 and law[HOLDS_AT_ONCE] == 0.0)


@inlined
def adapt(Phi: FloatArray, m: Parts) -> float:
    """Update whatever the profile has; g = F Phi and Phi^T F Phi are of the F before.

    ``m.diagonal`` then tells what the samples determine: it is that of F, or, where F does not fall with them, that of
    the decreasing gain ``known_U``, ``known_D`` that runs alongside it for this alone.
    """
    by_itself = informs_by_itself(m.law)
    if not by_itself:
        absorb(Phi, 1.0, m.known_U, m.known_D, m.g, m.f)
    s = gain(Phi, m.U, m.D, m.g, m.f) if m.law[LAMBDA2] == 0.0 else learn(Phi, m)
    if not by_itself:
        diagonal(m.known_U, m.known_D, m.diagonal)
    return s
