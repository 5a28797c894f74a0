"""The free run of a hypothesis as ``hil simulate`` makes it, and its error on samples that no fit has seen.

The likelihood weighs errors by their innovations; the figures of a diagnosis are of the free run itself. So what is a
recording's own (initial state, load torque, the course of a grade) is estimated anew, by least squares. All else is as
the likelihood has it where the hypothesis leaves nothing but its disturbances. Where it leaves more, the disturbances'
weighting is not that of what is left, and everything is estimated by least squares of the free run.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimator.diagnosis.chain import Chain
from estimator.diagnosis.holdout import blocks, foreign_outputs
from estimator.diagnosis.inference.descent import descended
from estimator.diagnosis.inference.likelihood import THOROUGH, Hypothesis, refitted
from estimator.diagnosis.inference.plausible import GRADE
from estimator.physics.fit import FitResult, fit, warm_start
from estimator.physics.model import DrivelineModel
from estimator.physics.problem import Problem, make_problem, parameters
from estimator.physics.unknowns import LocalBasis
from estimator.signals.record import BoolArray, FloatArray, Record

ITERATIONS = 8
"""Steps of a least-squares fit of what is a recording's own, which is nearly linear."""


def on_recordings(
    hypothesis: Hypothesis,
    line: DrivelineModel,
    records: Sequence[Record],
    is_whole: bool,
    use: Sequence[BoolArray] | None = None,
) -> FitResult:
    """Return the free run of a hypothesis on recordings it was fitted to, at their own rate.

    Parameters
    ----------
    is_whole : bool
        Whether the hypothesis leaves nothing but its disturbances: else its parameters are estimated anew, too.
    use : sequence of ndarray of bool, optional
        The samples to estimate from; by default all good ones.
    """
    of = hypothesis.plain.problem
    own = [basis.own for basis in of.local]
    problem = make_problem(line, records, of.shared, own=own, profile=GRADE in hypothesis.effects, use=use)
    own_alone = _with_own(problem, warm_start(problem, hypothesis.plain))
    if is_whole:
        return own_alone
    rms = own_alone.rms
    return descended(own_alone, lambda errors: errors / rms, THOROUGH).light()


def _with_own(problem: Problem, x: FloatArray) -> FitResult:
    """Estimate initial states, load torques and courses; phases and moments stay where they are."""
    count = len(problem.shared)
    held = tuple(_held(basis, x_i) for basis, x_i in zip(problem.bases, _parts(problem, x), strict=True))
    alone = replace(problem, p=parameters(problem, x), shared=(), local=tuple(held[lead] for lead in problem.leads))
    own = fit(alone, x[count:], ITERATIONS)
    return FitResult(problem, np.concatenate([x[:count], own.x]), own.outputs, own.residual, None, own.converged)


def _parts(problem: Problem, x: FloatArray) -> list[FloatArray]:
    ends = np.cumsum([basis.guess.size for basis in problem.bases])[:-1]
    return list(np.split(x[len(problem.shared) :], ends))


def _held(basis: LocalBasis, x: FloatArray) -> LocalBasis:
    values = (float(value) for value in x[basis.own_rows])
    own = tuple(replace(u, low=v, high=v, start=v) for u, v in zip(basis.own, values, strict=True))
    return replace(basis, own=own)


@dataclass(frozen=True, slots=True)
class Unseen:
    """The samples that judge: those of recordings kept out of the fit, else blocks of the recordings themselves.

    Attributes
    ----------
    line : DrivelineModel
    chain : Chain
        Of recordings kept out of every fit; empty where there are none.
    """

    line: DrivelineModel
    chain: Chain

    def rms(self, hypothesis: Hypothesis, whole: FitResult, is_whole: bool, seen: Chain, is_as_read: bool) -> float:
        """Return the RMS of a hypothesis' free-run error in blocks of 0.6 s every 2 s [unit of the output].

        What is between the blocks tells what is a recording's own. Without recordings kept out the hypothesis is
        fitted once more to what is between them; ``whole`` is its free run with the values of the whole fit.
        Where faults of the acquisition were recognised the readings judge: simulated ``as_read``, or as it is.
        """
        judging = self.chain if self.chain.records else seen
        records: Sequence[Record] = judging.records if self.chain.records else hypothesis.plain.problem.records
        if judging.findings and not self.chain.records:
            records = seen.apart
        between = [record.okay & ~blocks(record) for record in records]
        if self.chain.records:
            outputs = foreign_outputs(whole, self.line, records, between, hypothesis.effects)
        else:
            plain = hypothesis.plain
            if is_whole:
                of = plain.problem
                use = tuple(record.okay & ~blocks(record) for record in of.records)
                plain = refitted(hypothesis, replace(of, use=use))
            outputs = on_recordings(replace(hypothesis, plain=plain), self.line, records, is_whole, between).outputs
        firsts = [(out, record) for out, record in zip(outputs, records, strict=True) if record.lead is None]
        inside = [blocks(record) for _, record in firsts]
        if not judging.findings:
            errors = [(out - r.output)[r.okay & held] for (out, r), held in zip(firsts, inside, strict=True)]
        elif is_as_read:
            errors = judging.errors([out for out, _ in firsts], inside)
        else:
            pairs = zip(firsts, judging.raw, inside, strict=True)
            errors = [(out - raw.output)[raw.okay & held] for (out, _), raw, held in pairs]
        return float(np.sqrt(np.mean(np.concatenate(errors) ** 2)))
