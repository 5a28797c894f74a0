"""report.html: complete, self-contained, escaped, and of a size a mail takes."""

from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest

from estimator.diagnosis.result import Counted, Diagnosis, Doubt, Mismatch, OffNominal, Trace, Verdict
from estimator.physics.effect import Element
from hil.report.diagnosis_html import MOST_DRAWN, diagnosis_page, interval_bar
from hil.report.page import IntervalBar
from tests.report.conftest import figures, trace, unnamed_table

VOID = {"meta", "br", "hr", "img", "input", "link"}


class Reader(HTMLParser):
    """Collect the page's text outside scripts, its headings, and everything it would fetch."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.text = ""
        self.fetched: list[str] = []
        self.sections: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag not in VOID:
            self.open.append(tag)
        self.fetched += [f"{tag} {key}={value}" for key, value in attrs if key in ("src", "href", "data", "action")]
        self.fetched = [each for each in self.fetched if not each.startswith("a href=#")]  # a place in the page
        if tag == "h2":
            self.sections.append("")

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if "script" in self.open or "style" in self.open:
            assert "@import" not in data
            return
        self.text += data
        if self.open and self.open[-1] == "h2":
            self.sections[-1] += data


def read(page: str) -> Reader:
    reader = Reader()
    reader.feed(page)
    reader.close()
    assert reader.open == []
    return reader


def test_the_page_says_everything_from_the_verdict_down(diagnosis: Diagnosis) -> None:
    reader = read(diagnosis_page(diagnosis))
    assert reader.sections == [
        "Fit",
        "The physics found",
        "Where simulation and recording differ",
        "Over frequency",
        "Recording run_1",
        "Recording run_2",
        "Recording unseen",
        "Rejected effects",
        "Neither found nor excluded",
        "Parameters of the model",
    ]
    expected = (
        diagnosis.statement,  # holds characters that HTML has to escape
        "✓ explained",
        "Missing in the model: backlash in the shaft line or hysteresis of the shaft (18 of 18 such "
        "names were right: 100 %) and road grade",
        "run_2 has 60 samples missing",
        "1.41 rad/s",
        "0.0521 rad/s",
        "6.5 to 11 Hz",
        "from -20 to 20 Nm",
        "1.5 to 6.2 s, 17 to 22.1 s",
        "T_S = k e + c",
        "0.02 … 0.022",
        "could as well be explained by hysteresis of the shaft",
        "Over shaft torque k·twist: the line is the law",
        "6.25 to 12.5 Hz (218 ×)",
        "p = 1e-20",
        "explains 48 % of what backlash explains",
        "the speed never changes sign",
        "kg m^2",
        "-5.0 %",
    )
    assert [text for text in expected if text not in reader.text] == []


def test_the_page_fetches_nothing_and_holds_plotly_once(diagnosis: Diagnosis) -> None:
    page = diagnosis_page(diagnosis)
    assert read(page).fetched == []
    assert page.count('id="plotly"') == 1
    profile, law, places, spectrum, response = 1, 1, 1, 1, 1
    figures = 2 * len(diagnosis.traces) + profile + law + places + spectrum + response
    assert page.count('class="plotly-graph-div"') == figures


def test_the_same_diagnosis_makes_the_same_page(diagnosis: Diagnosis) -> None:
    assert diagnosis_page(diagnosis) == diagnosis_page(diagnosis)


def test_a_nominal_value_that_is_off_is_the_headline(diagnosis: Diagnosis) -> None:
    """It is no missing physics, and no name is needed for it."""
    off_nominal = (OffNominal("J_L", 1.11, 0.04), OffNominal("k", 1.07, 0.04))
    off = replace(diagnosis, verdict=Verdict.UNEXPLAINED, effects=(), off_nominal=off_nominal)
    text = read(diagnosis_page(off)).text
    assert "No physics need be missing, but the data sheet is off: J_L and k" in text
    assert "Something is missing" not in text


@pytest.mark.parametrize(
    ("verdict", "headline"),
    [
        (Verdict.NO_MISMATCH, "Nothing is missing"),
        (Verdict.UNEXPLAINED, "Something is missing, and no effect of the catalogue explains it"),
    ],
)
def test_the_other_answers_are_pages_too(diagnosis: Diagnosis, verdict: Verdict, headline: str) -> None:
    nan = float("nan")
    bare = replace(
        diagnosis,
        verdict=verdict,
        mismatch=Mismatch(False, None, {}, None, None, 0.4),
        effects=(),
        rejected=(),
        untestable=(),
        warnings=(),
        fit=replace(diagnosis.fit, holdout_retuned=nan, holdout_augmented=nan, noise_floor=0.0),
    )
    reader = read(diagnosis_page(bare))
    assert headline in reader.text
    assert reader.sections[0] == "Fit"
    assert reader.sections[-1] == "Parameters of the model"
    assert "Where simulation and recording differ" not in reader.sections


def test_faults_of_the_acquisition_have_their_own_section(diagnosis: Diagnosis) -> None:
    lost = replace(
        diagnosis.effects[0], name="lost_samples", element=Element.ACQUISITION, statement="a frame is missing"
    )
    reader = read(diagnosis_page(replace(diagnosis, effects=(*diagnosis.effects, lost))))
    first = reader.sections.index("Recognised in the recordings themselves")
    assert reader.sections[first + 1] == "The physics found"
    assert reader.text.count("a frame is missing") == 1


def test_parameters_are_drawn_between_their_tolerances() -> None:
    drawing = interval_bar(100.0, 110.0, 105.0, 115.0, 0.2)
    assert isinstance(drawing, IntervalBar)
    assert drawing.label == "+10.0 % of nominal, interval +5.0 to +15.0 %"
    assert drawing.tolerance[0] < 50.0 < drawing.interval[0] < drawing.value < drawing.interval[1] < 100.0
    assert interval_bar(0.0, 1.0, 0.5, 1.5, 0.2) == ""
    assert interval_bar(1.0, float("nan"), 0.5, 1.5, 0.2) == ""


def long_trace(number: int) -> Trace:
    n = 4_000
    rng = np.random.default_rng(number)
    noise = rng.normal(size=(7, n))
    scale = 1.0 if number else 1e-3
    return Trace(
        name=f"run_{number}",
        time_s=0.01 * np.arange(n),
        torque_nm=noise[:2].T,
        measured=noise[2],
        okay=np.ones(n, dtype=np.bool_),
        nominal=noise[3],
        retuned=noise[2] + scale * noise[4],
        augmented=noise[5],
        holdout=False,
    )


@pytest.mark.campaign
def test_many_long_recordings_stay_under_fifteen_megabytes(diagnosis: Diagnosis) -> None:
    traces = tuple(long_trace(number) for number in range(MOST_DRAWN + 1))
    seen = diagnosis.discrepancy
    assert seen is not None
    course = seen.equivalents[0].courses["run_1"]
    courses = {trace.name: course for trace in traces}
    places = tuple(replace(each, courses=courses) for each in seen.equivalents)
    responses = {trace.name: seen.responses["run_1"] for trace in traces}
    seen = replace(seen, equivalents=places, responses=responses)
    page = diagnosis_page(replace(diagnosis, traces=traces, discrepancy=seen))
    assert len(page.encode()) < 15e6
    sections = read(page).sections
    assert [f"Recording run_{number}" in sections for number in range(MOST_DRAWN + 1)] == [False] + [True] * MOST_DRAWN
    assert "1 more recordings, with smaller errors" in page


def test_three_recordings_of_a_minute_are_a_page_of_a_megabyte_and_a_half(diagnosis: Diagnosis) -> None:
    traces = tuple(trace(f"run_{seed}", False, seed, 6000) for seed in (1, 2, 3))
    assert len(diagnosis_page(replace(diagnosis, traces=traces)).encode()) < 1.5e6


def test_a_law_without_a_name_is_drawn_and_said(diagnosis: Diagnosis) -> None:
    page = diagnosis_page(replace(diagnosis, table=unnamed_table(), effects=()))
    assert "A law without a name" in page
    assert "On samples not used for its fit the free-run error falls with it from 0.41 to 0.12 rad/s." in page
    assert "It looks like a dead band of 0.02 rad." in page
    assert "A torque over the torque that is read explains nearly as much." in page
    assert "It does not carry over to run_2." in page
    assert "beyond the recordings" in figures(page)
    assert "the line alone" in figures(page)
    assert "A law without a name" not in diagnosis_page(diagnosis)


def test_errors_on_unseen_data_say_which_data_these_are(diagnosis: Diagnosis) -> None:
    kept_out = [each.name for each in diagnosis.traces if each.holdout]
    assert kept_out
    assert f"Unseen data: {kept_out[0]}, held out of every fit." in diagnosis_page(diagnosis)
    alone = replace(diagnosis, traces=tuple(each for each in diagnosis.traces if not each.holdout))
    assert "Unseen data: blocks all along the recordings, 30 % of each" in diagnosis_page(alone)


def test_how_much_an_effect_is_needed_and_how_often_such_names_were_right_are_shown(diagnosis: Diagnosis) -> None:
    page = diagnosis_page(diagnosis)
    assert page.count("of the squared error goes with it") == 1
    assert (
        "Without it 97% of the error beyond the noise comes back, on samples not used for the fit; 94% of the squared "
        "error goes with it. 18 of 18 such names were right: 100 %, it or a look-alike. Evidence:"
    ) in page


def test_a_name_that_is_often_wrong_has_no_tick_and_its_share(diagnosis: Diagnosis) -> None:
    effects = (replace(diagnosis.effects[0], counted=Counted(18, 22)), *diagnosis.effects[1:])
    page = diagnosis_page(replace(diagnosis, effects=effects))
    head = page.split("<h2")[0]
    assert "≈ explained, probably" in head
    assert "Missing in the model, probably: backlash" in head
    assert "18 of 22 such names were right: 82 %" in head
    assert "✓" not in head


def test_an_open_doubt_comes_first_without_tick_or_percentage(diagnosis: Diagnosis) -> None:
    doubt = Doubt("tip", "recording tip is implausible: it fits an inertia 1.53 times the nominal", 0.7, "scale = 2")
    effects = tuple(replace(effect, probability=float("nan"), counted=None) for effect in diagnosis.effects)
    page = diagnosis_page(replace(diagnosis, doubts=(doubt,), effects=effects))
    text = page[page.index("<body") :]
    assert "✓" not in text.split("<h2")[0]
    assert "names were right" not in text.split("<h2")[0]
    assert text.index("1.53 times the nominal") < text.index(diagnosis.statement[:20])
    assert "In [signals] write: <code>scale = 2</code>" in text
