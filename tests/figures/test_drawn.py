"""Printed figures: complete, of a size a page takes, the same bytes from the same data."""

import sys
from collections.abc import Callable
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure

from estimator.identification.identify import identify
from hil.errors import UsageError
from hil.figures.drawn import (
    WIDTH_IN,
    drawing,
    files_of,
    poles_figure,
    require_matplotlib,
    responses_figure,
    signals_figure,
)
from hil.figures.local_model import LocalModel, Reference, TwoMassLine
from tests.estimator.identification.driveline import B_L, B_M, J_L, J_M, C, K, cruise

LINE = TwoMassLine(J_M, J_L, K, C, B_M, B_L)


@pytest.fixture(scope="module")
def models() -> list[LocalModel]:
    records = [cruise(seed, name=f"run_{seed}").record for seed in (1, 2, 3)]
    return [LocalModel(record, identify(record), Reference("truth", LINE)) for record in records]


def drawn(make: Callable[[], Figure]) -> Figure:
    with drawing():
        return make()


def words(figure: Figure) -> str:
    found = [text.get_text() for axes in figure.axes for text in axes.texts]
    found += [axes.get_title(loc="left") for axes in figure.axes]
    found += [text.get_text() for legend in figure.legends for text in legend.get_texts()]
    return "\n".join(found)


def test_signals_stand_as_they_were_recorded(models: list[LocalModel]) -> None:
    figure = drawn(lambda: signals_figure([model.record for model in models]))
    assert len(figure.axes) == 6
    for column, model in enumerate(models):
        torque, speed = figure.axes[column].lines[0], figure.axes[3 + column].lines[0]
        np.testing.assert_array_equal(torque.get_ydata(), model.record.total_torque_nm)
        np.testing.assert_array_equal(speed.get_xdata(), model.record.time_s)
    assert "(c) run_3" in words(figure)


def test_every_experiment_has_its_responses_and_spare_panels_are_empty(models: list[LocalModel]) -> None:
    figure = drawn(lambda: responses_figure(models))
    for name in ("spectral estimate, 95 %", "on-line model (OEFO)", "off-line model", "truth", "run_2"):
        assert name in words(figure)
    assert figure.get_figwidth() == WIDTH_IN
    five = drawn(lambda: responses_figure([*models, *models[:2]]))
    assert [axes.axison for axes in five.axes[8:12]] == [True, False, False, False]


def test_the_map_shows_the_models_their_third_order_and_the_dominant_pole(models: list[LocalModel]) -> None:
    figure = drawn(lambda: poles_figure(models))
    assert "dominant pole" in words(figure)
    assert "truth" in words(figure)
    close = figure.axes[2]
    found = models[0].third_order
    assert found is not None
    pole = max(found.poles, key=lambda z: z.imag)
    assert close.get_xlim()[0] < pole.real < close.get_xlim()[1]
    assert close.get_ylim()[0] < pole.imag < close.get_ylim()[1]


@pytest.mark.campaign
def test_the_same_data_make_the_same_bytes_whatever_the_users_settings(
    models: list[LocalModel], tmp_path: Path
) -> None:
    written = []
    for number in range(2):
        with mpl.rc_context({"font.size": 30.0 * number + 4.0}):
            files = files_of("fig2", lambda: signals_figure([models[0].record]))
            assert sorted(files) == ["fig2.pdf", "fig2.svg"]
            for name, write in files.items():
                write(tmp_path / name)
        written.append([(tmp_path / name).read_bytes() for name in sorted(files)])
    assert written[0] == written[1]
    assert written[0][0].startswith(b"%PDF")


def test_where_there_is_nothing_to_draw_with_it_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    require_matplotlib()
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(UsageError, match="pip install 'matplotlib"):
        require_matplotlib()
