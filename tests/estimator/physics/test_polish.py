"""How long moments are moved and fitted in turn."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from estimator.physics import polish
from estimator.physics.starts import HEAT


@pytest.mark.parametrize(
    ("squares", "iterations", "left"),
    [
        ((90.0, 80.0, 70.0, 69.0, 60.0), 50, 69.0),
        ((99.0, 98.0, 97.0, 50.0), 50, 97.0),
        ((90.0, 95.0), 50, 90.0),
        ((90.0, 80.0), HEAT, 90.0),
        (tuple(100.0 * 0.8**i for i in range(1, 40)), 50, 100.0 * 0.8**polish.MOST_ROUNDS),
    ],
    ids=["while they help much", "three times at least", "until one does not", "once if begun", "not for ever"],
)
def test_moves_and_fits_take_turns(
    monkeypatch: pytest.MonkeyPatch, squares: tuple[float, ...], iterations: int, left: float
) -> None:
    fits = iter(squares)
    monkeypatch.setattr(polish.moments, "moved", lambda _: ("problem", "x"))
    monkeypatch.setattr(polish, "fit", lambda *_: SimpleNamespace(squares=next(fits)))
    result = polish.polished(SimpleNamespace(squares=100.0), iterations)  # type: ignore[arg-type]
    assert result.squares == pytest.approx(left)
