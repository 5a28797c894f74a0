"""What a re-tuned model lacks, from every side: for the report, and to locate what has no name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from estimator.diagnosis.evidence import VERY_STRONG
from estimator.diagnosis.intervals import Z95
from estimator.diagnosis.line import Explanation, Input, Line, lines
from estimator.diagnosis.result import Course, Discrepancy, Equivalent, LawPicture, RankedLaw
from estimator.diagnosis.unnamed import ROUNDS, Filter, Hunt, Scene, UnnamedLaw, hunts_of, judged, scene, without_law
from estimator.diagnosis.where.axes import input_unit
from estimator.diagnosis.where.picture import picture
from estimator.diagnosis.where.responses import responses
from estimator.diagnosis.where.spectrum import error_spectrum
from estimator.physics import model
from estimator.physics.catalogue import EFFECTS
from estimator.physics.fit import FitResult
from estimator.physics.problem import outputs_at


def discrepancy(
    retuned: FitResult,
    final: FitResult,
    floor: float,
    motion: model.Motion = model.Motion.ROTATION,
    rounds: int | None = None,
    begun: Sequence[Hunt] = (),
    whitening: Filter | None = None,
) -> Discrepancy:
    """Look at what a re-tuned model lacks, with the effects found or, where there are none, with laws without a name.

    Parameters
    ----------
    retuned : FitResult
        Fit of the nominal parameters within their tolerances.
    final : FitResult
        Fit with the effects found to the same recordings; ``retuned`` itself where none is believed.
    floor : float
        Noise floor [unit of the output].
    motion : Motion
        Rotation or translation, for the units.
    rounds : int, optional
        Rounds of the search for laws without a name; by default all (``ROUNDS``) where nothing is named, else one.
    begun : sequence of Hunt, optional
        What the first of them have found in ``retuned``, where there were any.
    whitening : Filter, optional
        By which laws are weighed; by default errors count as they are.

    Returns
    -------
    Discrepancy
    """
    view = scene(retuned, floor, whitening)
    named = effects_added(retuned, final)
    hunts = hunts_of(view, rounds or (1 if named else ROUNDS), begun)
    laws = sorted(judged(view, hunts), key=lambda law: -law.gain.delta_bic)
    best = laws[0] if laws and laws[0].gain.delta_bic > 0.0 else None
    if named:
        pictures = _pictures_of_effects(named, final, floor, motion)
    else:
        pictures = _picture_of_law(best, hunts, floor, motion)
    return Discrepancy(
        element=None if best is None else best.element,
        laws=tuple(
            RankedLaw(law.element, law.terms, law.rms, law.gain.delta_bic, law.gain.p_value)
            for law in laws
            if law.terms
        ),
        equivalents=_equivalents(view, motion),
        spectrum=error_spectrum(retuned, final, floor),
        responses=responses(retuned, final),
        pictures=pictures,
    )


def effects_added(retuned: FitResult, final: FitResult) -> tuple[str, ...]:
    """Return the effects with shared parameters that a fit has beyond another, in the catalogue's order."""
    before = {shared.effect for shared in retuned.problem.shared}
    after = {shared.effect for shared in final.problem.shared}
    return tuple(name for name in (*EFFECTS, *final.problem.grid.laws) if name in after - before)


def _equivalents(view: Scene, motion: model.Motion) -> tuple[Equivalent, ...]:
    most = max(each.log_likelihood for each in view.explanations.values())
    return tuple(
        Equivalent(
            place.value,
            input_unit(place, view.result, motion),
            _courses(view.cut, explanation),
            explanation.log_likelihood,
            2.0 * (most - explanation.log_likelihood) <= VERY_STRONG,
        )
        for place, explanation in view.explanations.items()
    )


def _courses(cut: Sequence[Line], explanation: Explanation) -> Mapping[str, Course]:
    return {line.record.name: _course(line, found) for line, found in zip(cut, explanation.inputs, strict=True)}


def _course(line: Line, found: Input) -> Course:
    spread = Z95 * found.std
    return Course(line.reading.time_s, found.value, found.value - spread, found.value + spread)


def _pictures_of_effects(
    named: Sequence[str], final: FitResult, floor: float, motion: model.Motion
) -> tuple[LawPicture, ...]:
    cut = lines(final)
    drawn = [_picture_of_effect(name, final, cut, floor, motion) for name in named]
    return tuple(each for each in drawn if each is not None)


def _picture_of_effect(
    name: str, final: FitResult, cut: Sequence[Line], floor: float, motion: model.Motion
) -> LawPicture | None:
    without, motions = without_effect(final, name), [line.motion for line in cut]
    return picture(name, EFFECTS[name].element, without, final.outputs, motions, floor, motion, cut[0].length)


def without_effect(result: FitResult, name: str) -> FitResult:
    """Return a fit with one effect's shared parameters at their nulls and all else as it is, simulated."""
    nulls = {parameter.name: parameter.null for parameter in EFFECTS[name].shared_parameters}
    kept = [j for j, shared in enumerate(result.problem.shared) if shared.effect != name]
    p = result.problem.p.copy()
    for shared in result.problem.shared:
        if shared.effect == name:
            p[shared.slot] = nulls[shared.name]
    count = len(result.problem.shared)
    x = np.concatenate([result.x[kept], result.x[count:]])
    problem = replace(result.problem, p=p, shared=tuple(result.problem.shared[j] for j in kept))
    columns = [*kept, *range(count, result.x.size)]
    return replace(result, problem=problem, x=x, derivative=result.jacobian[:, columns], outputs=outputs_at(problem, x))


def _picture_of_law(
    best: UnnamedLaw | None, hunts: Sequence[Hunt], floor: float, motion: model.Motion
) -> tuple[LawPicture, ...]:
    if best is None:
        return ()
    hunt = next(each for each in hunts if each.element is best.element)
    if not any(weights.any() for weights in hunt.weights):
        return ()
    motions = hunt.view.motions(hunt.element)
    outputs = hunt.view.result.outputs
    drawn = picture(
        " + ".join(name for name, _ in best.terms[:3]),
        best.element,
        without_law(hunt),
        outputs,
        motions,
        floor,
        motion,
        hunt.view.cut[0].length,
    )
    return () if drawn is None else (drawn,)
