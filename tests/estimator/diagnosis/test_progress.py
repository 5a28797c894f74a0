"""Progress is reported in rising shares, and raising from it cancels."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis import Verdict, diagnose
from estimator.signals.record import Record
from tests.chosen import campaign
from tests.estimator.diagnosis.planted import quiet, rubbing
from tests.estimator.physics.bench import ONE_MASS, model

LINE = model(ONE_MASS)


class Cancelled(Exception):
    """The user has had enough."""


def late(records: list[Record]) -> list[Record]:
    """A second effect: the torque acts three samples later than it was read."""
    return [replace(r, torque_nm=np.vstack([r.torque_nm[3:], np.tile(r.torque_nm[-1], (3, 1))])) for r in records]


def misread(records: list[Record]) -> list[Record]:
    """An effect that the catalogue does not have, at least not yet: the speed reads a little of its size too high."""
    return [replace(rec, output=rec.output + 0.05 * np.abs(rec.output)) for rec in records]


@pytest.mark.parametrize(
    "records",
    [
        rubbing(lambda speed: 0.0),
        pytest.param(rubbing(lambda speed: 12.0), marks=pytest.mark.campaign),
        late(rubbing(lambda speed: 12.0)),
        campaign(misread(quiet(values=ONE_MASS))),
    ],
    ids=["nothing", "one", "two", "unknown"],
)
def test_shares_rise_from_none_to_all(records: list[Record]) -> None:
    reported: list[tuple[str, float]] = []
    diagnose(records, LINE, progress=lambda *what: reported.append(what))
    shares = [share for _, share in reported]
    assert shares == sorted(shares)
    assert (shares[0], shares[-1]) == (0.0, 1.0)
    assert [stage for stage, _ in reported[:2]] == ["checking the recordings", "comparing hypotheses"]


@pytest.mark.parametrize("after", [0.2, 1.0])
def test_an_exception_from_it_cancels(after: float) -> None:
    reported: list[float] = []

    def stop(message: str, share: float) -> None:
        reported.append(share)
        if share >= after:
            raise Cancelled

    with pytest.raises(Cancelled):
        diagnose(rubbing(lambda speed: 12.0), LINE, progress=stop)
    assert [share for share in reported if share >= after] == reported[-1:]


@pytest.mark.campaign
def test_without_anybody_listening_the_answer_is_the_same() -> None:
    records = rubbing(lambda speed: 12.0)
    heard = diagnose(records, LINE, progress=lambda message, share: None)
    alone = diagnose(records, LINE)
    assert alone.verdict is heard.verdict is Verdict.EXPLAINED
    assert alone.statement == heard.statement
    assert alone.fit == heard.fit
