"""The pieces reports are made of: numbers, thinned traces, terminal summaries, folders of results."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies as st
from hypothesis.extra import numpy as st_numpy
from rich.console import Console, RenderableType

from estimator.diagnosis.result import Diagnosis
from estimator.identification.identify import identify
from estimator.identification.linear_model import LinearModel
from estimator.identification.modes.modes import square_root
from estimator.physics.model import Motion
from estimator.signals.record import OutputKind
from hil.errors import UsageError
from hil.report import bode, page as html, terminal
from hil.report.diagnosis_html import diagnosis_summary
from hil.report.figures import LONGEST_STRETCHES, extremes, input_lines, stretches_for
from hil.report.numbers import listed, p_statement, shown, shown_interval, shown_p, shown_ratio
from hil.report.wording import simulated_column
from hil.result_folder import publish
from tests.estimator.identification.driveline import cruise

NAN = float("nan")


def rendered(piece: RenderableType, width: int = 120) -> str:
    console = Console(width=width, color_system=None)
    with console.capture() as capture:
        console.print(piece)
    return capture.get()


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.0210001, "0.021"), (4200.0, "4200"), (123456.7, "123457"), (1e-9, "1e-09"), (NAN, "–"), (0.0, "0")],
)
def test_numbers_are_shown_with_four_digits(value: float, text: str) -> None:
    assert shown(value) == text


def test_numbers_carry_their_unit_only_where_there_is_one() -> None:
    assert shown(1.5, "Nm") == "1.5 Nm"
    assert shown_interval((0.02, NAN)) == "0.02 … –"
    assert shown_interval((0.35, 0.35)) == "held"
    assert [shown_p(0.0), shown_p(0.0123), shown_p(NAN)] == ["< 1e-100", "0.012", "–"]
    assert [shown_ratio(0.5, 0.25), shown_ratio(0.5, 0.0), shown_ratio(NAN, 1.0)] == ["2 ×", "–", "–"]
    assert [shown_ratio(1000.0, 1.0), shown_ratio(1001.0, 1.0)] == ["1e+03 ×", "> 1000 ×"]
    assert [listed(["a"]), listed(["a", "b"]), listed(["a", "b", "c"])] == ["a", "a and b", "a, b and c"]


@given(
    st_numpy.arrays(np.float64, st.integers(1, 400), elements=st.floats(-1e6, 1e6) | st.just(NAN)), st.integers(1, 50)
)
def test_a_thinned_trace_keeps_ends_order_and_extremes(y: np.ndarray, stretches: int) -> None:
    kept = extremes(y, stretches)
    assert (np.diff(kept) > 0).all()
    assert kept[0] == 0
    assert kept[-1] == y.size - 1
    assert kept.size <= 2 * stretches + 2
    if not np.isnan(y).all():
        assert np.nanmax(y[kept]) == np.nanmax(y)
        assert np.nanmin(y[kept]) == np.nanmin(y)


def test_recordings_share_the_size_of_a_page() -> None:
    assert stretches_for(0) == stretches_for(1) == LONGEST_STRETCHES
    assert 20 * stretches_for(20) <= 11_000


@pytest.mark.parametrize(
    ("count", "names"), [(1, ["input"]), (2, ["T_M1", "T_M2"]), (3, ["input 1", "input 2", "input 3"])]
)
def test_inputs_are_named_by_their_number(count: int, names: list[str]) -> None:
    assert [line.name for line in input_lines(np.zeros((4, count)))] == names


@pytest.mark.parametrize(
    ("kind", "motion", "column"),
    [
        (OutputKind.SPEED, Motion.ROTATION, "speed_sim_rad_s"),
        (OutputKind.SPEED, Motion.TRANSLATION, "speed_sim_m_s"),
        (OutputKind.POSITION, Motion.ROTATION, "position_sim_rad"),
        (OutputKind.POSITION, Motion.TRANSLATION, "position_sim_m"),
        (OutputKind.FORCE, Motion.ROTATION, "force_sim_nm"),
        (OutputKind.FORCE, Motion.TRANSLATION, "force_sim_n"),
    ],
)
def test_a_simulated_column_names_its_unit(kind: OutputKind, motion: Motion, column: str) -> None:
    assert simulated_column(kind, motion) == column


def test_the_terminal_tells_the_verdict_and_what_it_rests_on(diagnosis: Diagnosis) -> None:
    text = rendered(diagnosis_summary(diagnosis))
    expected = ("✓ explained", diagnosis.statement, "[rad/s]", "gap_rad", "0.021 rad", "J_M", "1.51 … 1.53")
    expected += ("hardening or softening shaft", "dry friction at the motor", "Note: run_2")
    expected += ("backlash in the shaft line: Without it 97% of the error beyond the noise comes back,",)
    expected += ("Unseen data: unseen, held out of every fit.",)
    assert "road grade: " not in text  # of which neither is known
    assert [part for part in expected if part not in text] == []


def test_results_appear_together_and_replace_older_ones(tmp_path: Path) -> None:
    folder = tmp_path / "deep" / "result"
    for text in ("old", "new"):
        publish(folder, {"a.txt": lambda path, t=text: path.write_text(t), "b.txt": lambda path: path.touch()})
    assert {path.name: path.read_text() for path in folder.iterdir()} == {"a.txt": "new", "b.txt": ""}


def test_a_result_that_fails_leaves_the_older_ones(tmp_path: Path) -> None:
    publish(tmp_path, {"a.txt": lambda path: path.write_text("old")})

    def fail(path: Path) -> None:
        path.write_text("half")
        raise OSError("disk full")

    with pytest.raises(UsageError, match="expected a folder to write into, got: disk full"):
        publish(tmp_path, {"a.txt": lambda path: path.write_text("new"), "b.txt": fail})
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"a.txt": "old"}


@pytest.mark.parametrize(
    ("value", "expected"), [(0.02, "p = 0.02"), (1e-300, "p < 1e-100"), (0.0, "p < 1e-100"), (float("nan"), "p = –")]
)
def test_a_probability_is_stated_as_far_as_it_means_something(value: float, expected: str) -> None:
    assert p_statement(value) == expected


def test_the_band_of_a_model_is_what_its_parameters_make_of_it() -> None:
    fit = identify(cruise(1).record).batch
    f = np.array([4.0, 8.0, 16.0])
    normal = np.random.default_rng(1).normal(size=(4000, fit.model.theta.size))
    drawn = fit.model.theta + normal @ square_root(fit.covariance).T
    models = [LinearModel.from_theta(theta, fit.model.orders, fit.model.sample_time_s) for theta in drawn]
    ratios = np.array([model.response(f) for model in models]) / fit.model.response(f)
    apart = np.maximum(np.log(np.abs(ratios)).std(axis=0), np.angle(ratios).std(axis=0))
    np.testing.assert_allclose(bode.spread_of(fit, f), 1.96 * apart, rtol=0.1)


@pytest.mark.parametrize("first", [-200.0, 100.0, 170.0])
def test_the_band_of_a_phase_does_not_cross_the_figure(first: float) -> None:
    f = np.geomspace(1.0, 10.0, 50)
    response = np.exp(1j * np.deg2rad(first - np.linspace(0.0, 150.0, 50)))
    figure = bode.panels()
    bode.estimate(figure, f, response, np.full(50, 0.02), np.ones(50), "#777777", "estimate")
    phases = [trace for trace in figure.data if trace.yaxis == "y2" and trace.mode == "lines"]
    assert phases
    assert all(np.abs(np.diff(np.asarray(trace.y))).max() < 10.0 for trace in phases)
    inside = np.rad2deg(np.angle(response))
    lows, highs = phases[::2], phases[1::2]
    held = [
        any(low.y[i] <= inside[i] <= high.y[i] for low, high in zip(lows, highs, strict=True)) for i in range(f.size)
    ]
    assert all(held)


@pytest.mark.parametrize("width", [40, 60, 80])
def test_a_narrow_terminal_takes_no_label_from_its_numbers(width: int) -> None:
    rows = [("nominal, as given", "0.7362", "14.7 ×", "–"), ("augmented", "0.05027", "1 ×", "0.04967")]
    headings = ("model", "RMS error [rad/s]", "to noise floor", "on unseen data [rad/s]")
    table = terminal.rendered([html.table(headings, rows, numbers=(1, 2, 3))])
    letters = "".join(rendered(table, width).split())
    for cell in ("nominal", "given", "augmente", "0.73", "14.7", "0.049"):
        assert cell in letters


def test_names_stay_whole_next_to_many_numbers() -> None:
    """At 80 columns, the headings of the numbers go over two lines."""
    headings = ("free run", "model", "RMS [rad/s]", "largest", "fit [%]", "load [Nm]", "samples", "p, past torque")
    rows = [("ce8_prbs1", "augmented.toml", "0.6703", "1.986", "5.713", "-0.5259", "500", "0.0056")]
    table = terminal.rendered([html.table(headings, rows, numbers=range(2, 8))])
    *_, names = rendered(table, 80).splitlines()
    assert names.split() == list(rows[0])


def test_a_name_that_is_one_word_stays_whole_next_to_one_of_several() -> None:
    headings = ("found", "element", "parameter", "value", "95 % interval")
    rows = [
        ("spring to the ground", "load", "stiffness_nm_per_rad", "0.4676 Nm/rad", "0.3931 … 0.5422"),
        ("saturation of the torque", "torque path", "limit_m1_nm", "0.02345 Nm", "0.002562 … 0.06912"),
    ]
    table = terminal.rendered([html.table(headings, rows, numbers=(3, 4))])
    shown = rendered(table, 80)
    assert [cell for cell in ("stiffness_nm_per_rad", *rows[1][3:], rows[0][4]) if cell not in shown] == []
    assert max(map(len, shown.splitlines())) <= 80
