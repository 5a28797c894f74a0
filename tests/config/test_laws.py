"""Laws that installed packages offer by entry points."""

import sys
from importlib.metadata import EntryPoint
from pathlib import Path
from types import ModuleType

import pytest

from estimator.physics.catalogue import EFFECTS
from estimator.physics.effect import Element
from estimator.physics.own_law import OwnLaw, OwnParameter
from hil.config import laws
from hil.config.model_file import read_model
from hil.errors import ModelFileError

EXAMPLE = Path(__file__).parents[2] / "examples" / "emps.toml"

LAW = OwnLaw(
    "offered",
    lambda t, w, load, twist, torque, size: size * w,
    Element.MOTOR,
    (OwnParameter("size", "", 0.0, 0.0, 1.0, 0.5),),
)


@pytest.fixture
def package(monkeypatch: pytest.MonkeyPatch) -> None:
    """A package that offers a law, a thing that is none, and one that isn't there."""
    module = ModuleType("a_package_of_laws")
    module.law, module.thing = LAW, 3  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, module.__name__, module)


def offer(monkeypatch: pytest.MonkeyPatch, value: str) -> None:
    def entry_points(group: str) -> list[EntryPoint]:
        return [EntryPoint("offered", value, group)]

    monkeypatch.setattr(laws, "entry_points", entry_points)


def test_an_installed_law_takes_part_in_every_model(package: None, monkeypatch: pytest.MonkeyPatch) -> None:
    offer(monkeypatch, "a_package_of_laws:law")
    model = read_model(EXAMPLE).model
    assert model.laws == ("offered",)
    assert EFFECTS[model.laws[0]].element is Element.MOTOR


@pytest.mark.parametrize(
    ("value", "said"),
    [
        (
            "a_package_of_laws:thing",
            "laws.offered | expected entry point a_package_of_laws:thing to be an OwnLaw | got 3",
        ),
        ("a_package_of_laws:missing", "to load | got AttributeError"),
        ("no_such_package:law", "to load | got ModuleNotFoundError"),
    ],
)
def test_an_offer_that_is_no_law_is_refused(
    package: None, monkeypatch: pytest.MonkeyPatch, value: str, said: str
) -> None:
    offer(monkeypatch, value)
    with pytest.raises(ModelFileError) as refused:
        read_model(EXAMPLE)
    assert said in str(refused.value)
