"""What the tool may see: nothing withheld, nothing else than was meant, numbers to the last bit."""

import numpy as np
import pytest

from hil.proof.real.case_file import RealFileError, read_case
from hil.proof.real.prepare import write_shown
from hil.recording import read_record
from hil.recording.formats import read_table
from tests.proof.real import made_up


@pytest.fixture
def place(tmp_path):
    place = tmp_path / "place"
    place.mkdir()
    return place


@pytest.fixture
def data(tmp_path):
    return tmp_path / "data"


@pytest.fixture
def case(tmp_path, data):
    return read_case(made_up.write_case(tmp_path / "room", data))


def test_a_withheld_channel_is_not_written(case, data, place):
    path = write_shown(case, "first", data, place)
    original = read_table(data / "trolley" / "a.csv")
    shown = read_table(path)
    assert path == place / "first.csv"
    assert list(shown.columns) == ["t", "force", "speed"]
    assert "secret" not in path.read_text()
    for name, values in shown.columns.items():
        np.testing.assert_array_equal(values, original.columns[name])


def test_hidden_samples_are_missing_and_all_others_are_there(case, data, place):
    hide = np.zeros(made_up.N, dtype=bool)
    hide[10:16] = True
    record = read_record(write_shown(case, "first", data, place, {"speed": hide}), _signals())
    np.testing.assert_array_equal(record.okay, ~hide)


def test_a_recording_is_written_again_with_samples_hidden(case, data, place):
    """Also where names such as "speed [rad/s]" give it metadata next to it."""
    path = write_shown(case, "first", data, place)
    path.with_name("first.csv.json").write_text('{"schema": "hil.recording/1"}')
    hide = np.ones(made_up.N, dtype=bool)
    assert write_shown(case, "first", data, place, {"speed": hide}) == path
    assert np.isnan(read_table(path).columns["speed"]).all()


def _signals():
    from hil.recording.signals_config import SignalsConfig

    return SignalsConfig.model_validate(
        {"time": {"column": "t"}, "torque": [{"column": "force"}], "speed": {"column": "speed"}}
    )


def test_a_recording_is_cut_to_its_rows(tmp_path, place, data):
    text = made_up.CASE.replace('path = "trolley/a.csv"', 'path = "trolley/a.csv"\nrows = [100, 150]')
    case = read_case(made_up.write_case(tmp_path / "room", data, case=text))
    shown = read_table(write_shown(case, "first", data, place))
    assert shown.n_rows == 50
    assert shown.columns["t"][0] == pytest.approx(10.0)


def test_another_recording_than_was_meant_is_refused(case, data, place):
    path = data / "trolley" / "a.csv"
    path.write_text(path.read_text().replace("speed", "Speed"))
    with pytest.raises(RealFileError, match=r"expected the SHA-256 [0-9a-f]{64}, got"):
        write_shown(case, "first", data, place)


def test_a_missing_recording_is_refused_and_says_where_it_is_from(case, data, place):
    (data / "trolley" / "a.csv").unlink()
    with pytest.raises(RealFileError, match=r"(?s)got nothing.*real\.download.*https://example\.org/trolley"):
        write_shown(case, "first", data, place)


def test_a_shown_channel_that_is_not_there_is_refused(tmp_path, data, place):
    text = made_up.CASE.replace('"force", "speed"]', '"force", "speed", "pedal"]')
    case = read_case(made_up.write_case(tmp_path / "room", data, case=text))
    with pytest.raises(RealFileError, match="pedal"):
        write_shown(case, "first", data, place)
    assert not list(place.iterdir())
