"""A bench: hypotheses fitted on a model and recordings, from where others ended, and remembered."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from estimator.diagnosis.evidence import VERY_STRONG, gain
from estimator.diagnosis.hypotheses import NOTHING, Effects, effects_of
from estimator.diagnosis.inherit import forgetting, inheriting, kept, line_values, placed
from estimator.diagnosis.screening import Screen, promising
from estimator.diagnosis.shooting import can_be_shot, shot
from estimator.physics.catalogue import EFFECTS
from estimator.physics.effect import Start
from estimator.physics.fit import FitResult, fit, not_fitted
from estimator.physics.grid import Grid
from estimator.physics.model import DrivelineModel
from estimator.physics.moments import without_idle
from estimator.physics.polish import polished
from estimator.physics.problem import Problem, make_problem
from estimator.physics.starts import HEAT, begun, best_fit, close, converge, warm_start
from estimator.physics.steps import from_their_moment
from estimator.physics.unknowns import Release, nominal_unknowns, own_unknowns, released
from estimator.signals.record import BoolArray, Record

STEPS_ANEW = 5
"""Jacobians that an effect fitted once more, or written another way, gets before it is given up: it starts from what
was no fit of it."""

HOPELESS = 2.0
"""Squared error after them, over that of the law as it was, beyond which it is."""

FURTHER = 8
"""Jacobians that a rough fit gets before it is compared once more."""

MOST_SHOTS = 3
"""Times that a fit is begun anew in stretches."""

WORTH_ANOTHER_FIT = 0.1
"""Share of the squared error that a look from a fit must promise for an effect to be fitted once more (those that found
another minimum promised half of it, those that came back to where they were a fiftieth), and that one in stretches
must have taken away for the next."""

MUCH_BYTES = 2**24
"""Room of a derivative that is rather found again than kept: a round of the search has a dozen of them."""


@dataclass
class Bench:
    """A model and recordings on which hypotheses are fitted, each set of effects once.

    Attributes
    ----------
    use : sequence of ndarray of bool
        Which samples count in each recording.
    grid : Grid, optional
        What they are simulated on; by default as fine as the line needs.
    """

    model: DrivelineModel
    records: Sequence[Record]
    use: Sequence[BoolArray]
    grid: Grid | None = None
    _fits: dict[Effects, FitResult] = field(default_factory=dict)
    _rough: dict[Effects, FitResult] = field(default_factory=dict)
    _looked_again: set[tuple[Effects, str]] = field(default_factory=set)
    _retold: set[tuple[Effects, str]] = field(default_factory=set)
    _lessened: set[tuple[Effects, bytes]] = field(default_factory=set)
    _shot: set[tuple[Effects, bytes]] = field(default_factory=set)
    _tried: dict[Effects, list[Release]] = field(default_factory=dict)

    def fit(self, effects: Effects, warm: FitResult | None = None, releases: Sequence[Release] = ()) -> FitResult:
        """Fit the nominal parameters, within their tolerances, together with a set of effects.

        Parameters
        ----------
        warm : FitResult, optional
            A fit whose values the common unknowns start from.
        releases : sequence of Release, optional
            Start points of the one effect that ``warm`` lacks; by default where a first look places them.
        """
        known = self._fits.get(effects)
        if known is None or not known.converged:
            begun = self._rough.get(effects) if known is None else known
            result = self._fit(effects, warm, releases) if begun is None else polished(converge(begun))
            self._remember(effects, result)
        return self._fits[effects]

    def on(self, grid: Grid) -> Bench:
        """Return the same model and recordings on another grid, without any fits."""
        return Bench(self.model, self.records, self.use, grid)

    def go_on_from(self, other: FitResult) -> FitResult:
        """Take a fit that was made on another grid to its end on this one."""
        problem = replace(other.problem, grid=self.grid or other.problem.grid)
        return self._better(effects_of(other), polished(fit(problem, other.x)))

    def fit_again(self, effects: Effects, name: str) -> FitResult:
        """Look for the rest of an effect once what it loosens is loose, and return the better of both fits.

        A first look around a fit that its bounds hold sees nothing of what stands behind them. Looked for once.
        """
        had = self._fits[effects]
        if (effects, name) in self._looked_again:
            return had
        self._looked_again.add((effects, name))
        looks = promising(Screen(had, self.model).looks(name, EFFECTS[name].loosened_by))
        if looks[0].promise < WORTH_ANOTHER_FIT * had.squares:
            return had
        warm = forgetting(had, name)
        heat = begun(self._problems(effects, warm, [look.release for look in looks]), warm, STEPS_ANEW)
        best = heat[close(heat)[0]]
        return had if _is_hopeless(best, had) else self._better(effects, polished(converge(best)))

    def fit_retold(self, effects: Effects, name: str) -> FitResult:
        """Fit an effect's law written other ways from where it ended, and return what explains best, per unknown.

        Each law beside the same others is written other ways once.
        """
        had = self._fits[effects]
        values = had.values_of(name)
        if not values or (effects, name) in self._retold:
            return had
        self._retold.add((effects, name))
        entry = EFFECTS[name]
        fits = []
        for other in entry.retold(self.model, self.records, values, line_values(had)):
            warm = placed(forgetting(had, name), other.line)
            starts = self._retold_from(name, other.start)
            (heat,) = begun(self._problems(effects, warm, starts), warm, STEPS_ANEW)
            if not _is_hopeless(heat, had):
                fits.append(polished(converge(heat)))
        plausible = [fit for fit in fits if not entry.implausible(self.model, self.records, fit.values_of(name))]
        best = min(plausible, key=lambda fit: fit.squares, default=had)
        if best is not had and _is_told_better(had, best):
            self._remember(effects, best)
        return self._fits[effects]

    def _retold_from(self, name: str, start: Start) -> list[Release]:
        """Return an effect's parameters that all recordings share from one start; each keeps what it has of its own."""
        return [
            replace(release, own=((),) * len(self.records))
            for release in released(name, self.model, self.records, [start])
        ]

    def left_without(self, effects: Effects, rival: str, had: FitResult) -> FitResult:
        """Return what is left of a fit without one of its effects, the others where it has brought them."""
        warm = forgetting(had, rival)
        (problem,) = self._problems(effects, warm, ())
        return not_fitted(problem, warm_start(problem, warm))

    def rough_in_place(self, effects: Effects, placed: FitResult, releases: Sequence[Release]) -> FitResult:
        """Fit an effect beside others from where these were placed, a few steps only."""
        heat = begun(self._problems(effects, placed, releases), placed)
        return heat[close(heat)[0]]

    def finish_in_place(self, effects: Effects, rough: FitResult) -> FitResult:
        """Take such a fit to its end, and return the better of it and the one that is known."""
        return self._better(effects, polished(converge(rough)))

    def fit_widely(self, effects: Effects, name: str) -> FitResult:
        """Fit an effect from every start not yet tried, promising or not, and return the best of these and the known.

        What one effect leaves in a poorer minimum, another would be named for.
        """
        before, tried = self.fit(effects - {name}), self._tried.get(effects, [])
        looks = Screen(before, self.model).looks(name)
        releases = [look.release for look in looks if look.release not in tried]
        if not releases:
            return self._fits[effects]
        return self._better(effects, self._fit(effects, before, releases))

    def fit_in_stretches(self, effects: Effects) -> FitResult:
        """Fit once more from where stretches lead, where the error has many small minima, while that helps much.

        What such a minimum leaves looks like an event here and there. Each fit is begun anew once.
        """
        result = self._fits[effects]
        bounces = any(EFFECTS[name].bounces for name in effects | set(self.model.effects))
        for _ in range(MOST_SHOTS if bounces and can_be_shot(result) else 0):
            place = (effects, result.x.tobytes())
            if place in self._shot:
                break
            self._shot.add(place)
            had, result = result, self._better(effects, polished(shot(result, self.model)))
            if result.squares > (1.0 - WORTH_ANOTHER_FIT) * had.squares:
                break
        return result

    def fit_less(self, effects: Effects, larger: FitResult) -> FitResult:
        """Fit fewer effects from where a fit with more ended, too, and return the better of both.

        What was found beside another effect may be out of reach from where these began by themselves. Each larger fit
        is begun from once.
        """
        place = (effects, larger.x.tobytes())
        if place not in self._lessened:
            self._lessened.add(place)
            self._better(effects, self._fit(effects, larger, ()))
        return self.fit(effects)

    def _better(self, effects: Effects, result: FitResult) -> FitResult:
        """Remember a fit if it is better than what is known, and return the better one."""
        known = self._fits.get(effects)
        if known is None or result.squares < known.squares:
            self._remember(effects, result)
        return self._fits[effects]

    def _remember(self, effects: Effects, result: FitResult) -> None:
        """Remember a fit with its steps told from their moment on, which may explain more."""
        told = from_their_moment(result, self.model)
        self._fits[effects] = _without_much(result if told is result else polished(told))

    def fit_by_steps(self, effects: Effects) -> FitResult:
        """Fit a set of effects of which none has been fitted here, one after the other along the chain."""
        result, had = self.fit(NOTHING), NOTHING
        for name in (name for name in EFFECTS if name in effects):
            had = had | {name}
            result = self.fit(had, result)
        return result

    def rough_fit(self, effects: Effects, warm: FitResult, releases: Sequence[Release]) -> FitResult:
        """Fit as ``fit`` does, a few steps only; ``fit`` goes on from there.

        Starts that stay close behind the best one count as not yet tried.
        """
        if effects in self._fits:
            return self._fits[effects]
        if effects not in self._rough:
            heat = begun(self._problems(effects, warm, releases), warm)
            best, *behind = close(heat)
            self._tried[effects] = [release for i, release in enumerate(releases) if i not in behind]
            self._rough[effects] = _without_much(polished(heat[best], HEAT))
        return self._rough[effects]

    def go_on(self, effects: Effects) -> FitResult:
        """Take a rough fit some steps further; ``fit`` goes on from there."""
        if effects in self._fits:
            return self._fits[effects]
        rough = self._rough[effects]
        if not rough.converged:
            self._rough[effects] = _without_much(fit(rough.problem, rough.x, FURTHER))
        return self._rough[effects]

    def let_go(self, keep: Effects) -> None:
        """Take the derivatives out of all fits but one: what lost is rarely looked at again."""
        for fits in (self._fits, self._rough):
            for effects, result in fits.items():
                if effects != keep:
                    fits[effects] = result.light()

    def settle(self, effects: Effects) -> FitResult:
        """Take events that do nothing out of single recordings, and tell steps from their moment on, from now on."""
        self._fits[effects] = from_their_moment(without_idle(self._fits[effects]), self.model)
        return self._fits[effects]

    def _fit(self, effects: Effects, warm: FitResult | None, releases: Sequence[Release]) -> FitResult:
        return polished(best_fit(self._problems(effects, warm, releases), warm))

    def _problems(self, effects: Effects, warm: FitResult | None, releases: Sequence[Release]) -> list[Problem]:
        """Return the fit of a set of effects from each start of the one that ``warm`` lacks."""
        had = NOTHING if warm is None else effects_of(warm)
        common = kept(warm, effects | set(self.model.effects)) if warm is not None else self._nominal()
        new = sorted(name for name in effects - had if not EFFECTS[name].profile)
        if new and not releases:
            if warm is None:
                raise ValueError("a set of effects is fitted from a fit without them, came none")
            releases = [look.release for look in promising(Screen(warm, self.model).looks(new[0]))]
        if new and warm is not None:
            releases = [inheriting(new[0], release, warm) for release in releases]
        return [
            self._problem(
                effects,
                Release(
                    (*common.shared, *release.shared),
                    tuple((*old, *mine) for old, mine in zip(common.own, release.own, strict=True)),
                ),
            )
            for release in (releases or [Release((), ((),) * len(self.records))])
        ]

    def _problem(self, effects: Effects, release: Release) -> Problem:
        return make_problem(
            self.model,
            self.records,
            release.shared,
            own=release.own,
            profile=any(EFFECTS[name].profile for name in effects),
            use=self.use,
            grid=self.grid,
        )

    def _nominal(self) -> Release:
        """Return the nominal parameters, and what the model's own effects leave to every recording."""
        own = tuple(own_unknowns(self.model.effects, record) for record in self.records)
        return Release(nominal_unknowns(self.model), own)


def _is_hopeless(begun_anew: FitResult, had: FitResult) -> bool:
    """Tell whether a law that was begun anew, or another way, is too far behind for its fit to be gone on with."""
    return begun_anew.squares > HOPELESS * had.squares


def _is_told_better(had: FitResult, other: FitResult) -> bool:
    """Tell whether a law written another way is to be kept: with more unknowns it must say clearly more."""
    if other.free_count > had.free_count:
        return gain(had, other).delta_bic >= VERY_STRONG
    return gain(other, had).delta_bic <= 0.0


def _without_much(result: FitResult) -> FitResult:
    """Let a derivative go that takes much room: that of a long recording with its load's profile."""
    if result.derivative is None or result.derivative.nbytes <= MUCH_BYTES:
        return result
    return result.light()
