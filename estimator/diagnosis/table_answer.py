"""A law without a name next to what is decided: tried for the augmented model, and in it where that is better.

It is part of the answer only where the error of the augmented model falls with it, on what was fitted and on data that
no fit has seen.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from estimator.diagnosis.assemble import rms_of
from estimator.diagnosis.inference.decide import Decision
from estimator.diagnosis.inference.figures import FreeRuns, Unseen, foreign_outputs, on_recordings
from estimator.diagnosis.inference.hypotheses import Hypothesis, all_good_samples
from estimator.diagnosis.result import Fit, Trace, UnnamedTable
from estimator.diagnosis.table_curves import FEWEST_SAMPLES
from estimator.diagnosis.tables import Effects, TableFit, best_table
from estimator.physics.fit import FitResult
from estimator.physics.model import DrivelineModel, EffectValue

NO_LAW = (
    f"No law without a name is in the augmented model: no curve with {FEWEST_SAMPLES} samples between its knots lowers "
    "the error on data that no fit has seen."
)


@dataclass(frozen=True, slots=True)
class Law:
    """A law without a name that is in the augmented model."""

    fit: Fit  # the decision's figures, those of the augmented model with the law
    found: TableFit  # its fit to the recordings
    final: FitResult  # the free runs of all recordings with it
    line: DrivelineModel  # the line with the law among its effects

    @property
    def table(self) -> UnnamedTable:
        """The law, as it is reported."""
        return self.found.law

    def augmented(self, model: DrivelineModel) -> DrivelineModel:
        """Return a model with the law, and the line and its effects as they are next to it."""
        of_line = self.final.values_of("")
        parameters = {name: p.at(of_line.get(name, p.value)) for name, p in model.parameters.items()}
        effects: dict[str, Mapping[str, EffectValue]] = {}
        for name, values in model.effects.items():
            found = self.final.values_of(name)
            effects[name] = {key: value.at(found.get(key, value.value)) for key, value in values.items()}
        return _with_effects(replace(model, parameters=parameters, effects=effects), self.found.effects)

    def drawn(self, traces: tuple[Trace, ...], believed: Hypothesis, runs: FreeRuns) -> tuple[Trace, ...]:
        """Return the simulations for plots, the augmented ones with the law."""
        kept_out = runs.unseen.chain.records
        outputs = [*runs.chain.read(self.final.outputs)]
        if kept_out:
            outputs += foreign_outputs(self.final, self.line, kept_out, all_good_samples(kept_out), believed.effects)
        return tuple(replace(trace, augmented=out) for trace, out in zip(traces, outputs, strict=True))


def unnamed_law(decision: Decision) -> Law | None:
    """Return the best law without a name next to what is believed; None where nothing is left, or none is better."""
    judged, runs, figures = decision.judged, decision.runs, decision.figures
    if not judged.failed or judged.off_nominal:
        return None
    believed, line = judged.believed.hypothesis, runs.unseen.line
    found = best_table(believed, line, runs.unseen.chain.records)
    if found is None:
        return None
    tabled = _with_effects(line, found.effects)
    with_it = replace(believed, result=found.result)
    after = on_recordings(with_it, tabled, runs.chain.separated, is_whole=False)
    result, effects = found.between or (found.result, found.effects)  # recordings that are kept out judge the whole one
    unseen = Unseen(_with_effects(line, effects), runs.unseen.chain)
    held = unseen.rms(replace(believed, result=result), after, False, runs.chain, is_as_read=True)
    final = after.first_outputs()
    rms = rms_of(runs.chain.errors(final.outputs))
    if rms >= figures.augmented or held >= figures.holdout_augmented:
        return None
    fit = replace(figures, augmented=rms, holdout_augmented=held)
    law = replace(found.law, rms_before=figures.holdout_augmented, rms_after=held)  # on the samples of all figures
    return Law(fit, replace(found, law=law), final, tabled)


def _with_effects(model: DrivelineModel, effects: Effects) -> DrivelineModel:
    return replace(model, effects={**model.effects, **effects})


def sentences(table: UnnamedTable, of: str) -> str:
    """Return what is said of the law, for the end of a statement."""
    parts = (
        f"A law without a name is in the augmented model: a torque over {table.over}, through "
        f"{len(table.knots)} knots. On samples not used for its fit the free-run error falls with it "
        f"from {table.rms_before:.4g} to {table.rms_after:.4g} {of}.",
        table.looks_like and f"It looks like {table.looks_like}.",
        table.formula and f"The shortest formula within its band, with x for {table.over}: {table.formula}.",
        table.rival and f"A torque over {table.rival} explains nearly as much.",
        f"It does not carry over to {', '.join(table.not_carried)}." if table.not_carried else "",
    )
    return " ".join(filter(None, parts))
