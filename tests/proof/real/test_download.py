"""The download against a server on loopback: checked, resumed, converted, and plain words where it can't be."""

import hashlib
import io
import json
import threading
import zipfile
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import pytest

from hil.errors import UsageError
from hil.proof.real import download as module
from hil.proof.real.case_file import Conversion, Origin, RecordingEntry
from hil.proof.real.convert import HEADER, NotAsPublished, friction_damper
from hil.proof.real.convert import main as convert
from hil.proof.real.download import download, main, wanted
from hil.proof.real.fetch import FetchFailed, fetch
from tests.proof.real import made_up

CONTENT = b"t,force,speed\n" + b"0.0,1.0,2.0\n" * 1000


class Site(ThreadingHTTPServer):
    """Serves files by path, whole or from a byte on; breaks off after so many bytes where a test says so."""

    def __init__(self):
        super().__init__(("127.0.0.1", 0), Page)
        self.files = {"/a.csv": CONTENT}
        self.break_after = None
        self.asked = []

    def url(self, path):
        return f"http://127.0.0.1:{self.server_port}{path}"


class Page(BaseHTTPRequestHandler):
    def do_GET(self):
        site = self.server
        site.asked.append((self.path, self.headers.get("Range")))
        content = site.files.get(self.path)
        if content is None:
            self.send_error(404)
            return
        first = int((self.headers.get("Range") or "bytes=0-")[6:-1])
        if first >= len(content):
            self.send_error(416)
            return
        self.send_response(206 if first else 200)
        self.send_header("Content-Length", str(len(content) - first))
        self.end_headers()
        self.wfile.write(content[first : first + (site.break_after or len(content))])

    def log_message(self, *_):
        """Say nothing."""


@pytest.fixture
def site():
    site = Site()
    thread = threading.Thread(target=site.serve_forever, kwargs={"poll_interval": 0.01})
    thread.start()
    yield site
    site.shutdown()
    thread.join()
    site.server_close()


def entry(content, url, member=None, convert=Conversion.NONE, path="set/a.csv"):
    origin = Origin(page="https://example.org/set", url=url, member=member, convert=convert)
    return RecordingEntry(path=path, sha256=hashlib.sha256(content).hexdigest(), origin=origin)


def had(wanted_entry, to):
    lines = []
    failed = download([wanted_entry], to, lines.append)
    return lines, failed


def test_a_recording_is_fetched_checked_and_not_fetched_again(site, tmp_path):
    assert had(entry(CONTENT, site.url("/a.csv")), tmp_path) == ([f"set/a.csv: from {site.url('/a.csv')}"], [])
    assert (tmp_path / "set" / "a.csv").read_bytes() == CONTENT
    assert had(entry(CONTENT, site.url("/a.csv")), tmp_path) == (["set/a.csv: there already"], [])
    assert len(site.asked) == 1


def test_a_transfer_that_broke_off_continues(site, tmp_path):
    site.break_after = 5000
    _, (message,) = had(entry(CONTENT, site.url("/a.csv")), tmp_path)
    assert "the connection broke off after 5000" in message
    assert not (tmp_path / "set" / "a.csv").exists()
    site.break_after = None
    assert had(entry(CONTENT, site.url("/a.csv")), tmp_path)[1] == []
    assert (tmp_path / "set" / "a.csv").read_bytes() == CONTENT
    assert site.asked[-1] == ("/a.csv", "bytes=5000-")


def test_a_wrong_file_does_not_take_the_place_and_is_not_continued_with(site, tmp_path):
    _, (message,) = had(entry(b"something else", site.url("/a.csv")), tmp_path)
    assert f"got {hashlib.sha256(CONTENT).hexdigest()}" in message
    assert list((tmp_path / "set").iterdir()) == []


def test_a_file_is_taken_out_of_an_archive(site, tmp_path):
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w") as file:
        file.writestr("deep/inside/a.csv", CONTENT)
        file.writestr("readme.txt", "nothing")
    site.files["/set.zip"] = archive.getvalue()
    assert had(entry(CONTENT, site.url("/set.zip"), member="a.csv"), tmp_path)[1] == []
    assert (tmp_path / "set" / "a.csv").read_bytes() == CONTENT


@pytest.mark.parametrize("content", [b"<html>please sign in</html>", None])
def test_what_is_no_such_archive_is_said(site, tmp_path, content):
    if content is None:
        archive = io.BytesIO()
        with zipfile.ZipFile(archive, "w") as file:
            file.writestr("other.csv", "x")
        content = archive.getvalue()
    site.files["/set.zip"] = content
    _, (message,) = had(entry(CONTENT, site.url("/set.zip"), member="a.csv"), tmp_path)
    assert "expected" in message
    assert "take a.csv out of the archive" in message
    assert list((tmp_path / "set").iterdir()) == []


def test_a_published_file_is_converted_to_the_recording(site, tmp_path):
    published = json.dumps({"data": [[0.0, 1.0, 0.5, -2.0, 9.0, 9.0], [0.0009765625, 0.1, -0.25, 4.0, 9.0, 9.0]]})
    csv = f"{HEADER}\n0.0000000,0.0254,-0.0508,2224.11\n0.0009766,0.00254,0.1016,-1112.06\n".encode()
    site.files["/a.json"] = published.encode()
    assert had(entry(csv, site.url("/a.json"), convert=Conversion.FRICTION_DAMPER), tmp_path)[1] == []
    assert (tmp_path / "set" / "a.csv").read_bytes() == csv


@pytest.mark.parametrize("content", [b"not json", b'{"rows": []}', b'{"data": [[1.0]]}'])
def test_what_is_not_as_published_is_refused(content):
    with pytest.raises(NotAsPublished, match="expected JSON"):
        friction_damper(content)


def test_a_file_had_by_hand_is_converted(tmp_path, capsys):
    (tmp_path / "a.json").write_text('{"data": [[0.0, 1.0, 0.5, -2.0]]}')
    out = tmp_path / "joint" / "a.csv"
    assert convert(["friction_damper", str(tmp_path / "a.json"), str(out)]) == 0
    assert out.read_text() == f"{HEADER}\n0.0000000,0.0254,-0.0508,2224.11\n"
    with pytest.raises(SystemExit, match="2"):
        convert(["friction_damper", str(out), str(out)])
    assert "expected JSON" in capsys.readouterr().err


def test_what_a_server_refuses_is_said_with_what_to_do_by_hand(site, tmp_path):
    _, (message,) = had(entry(CONTENT, site.url("/gone.csv")), tmp_path)
    assert "the server says 404" in message
    assert f"put it at {tmp_path / 'set' / 'a.csv'}" in message
    assert hashlib.sha256(CONTENT).hexdigest() in message


def test_without_a_connection_it_is_said(site, tmp_path):
    url = site.url("/a.csv").replace(str(site.server_port), "1")
    with pytest.raises(FetchFailed, match="expected a connection"):
        fetch(url, tmp_path / "part")
    _, (message,) = had(entry(CONTENT, url), tmp_path)
    assert "By hand: open" in message


def test_what_a_person_must_fetch_is_said(tmp_path):
    _, (message,) = had(entry(CONTENT, None), tmp_path)
    assert "asks for an account" in message
    assert "open https://example.org/set, put it at" in message


def test_a_whole_part_is_taken_as_it_is(site, tmp_path):
    (tmp_path / "set").mkdir()
    (tmp_path / "set" / ".a.csv.part").write_bytes(CONTENT)
    assert had(entry(CONTENT, site.url("/a.csv")), tmp_path)[1] == []


def test_cases_that_share_a_file_must_agree_on_it(tmp_path):
    room = tmp_path / "room"
    made_up.write_case(room, tmp_path / "data")
    made_up.write_case(room, tmp_path / "data", name="again")
    assert sorted(wanted((), room)) == ["trolley/a.csv", "trolley/b.csv"]
    case = room / "again" / "case.toml"
    case.write_text(case.read_text().replace('example.org/trolley" }', 'example.org/other" }'))
    with pytest.raises(UsageError, match="one checksum and origin"):
        wanted((), room)


def test_the_command_ends_with_2_where_something_could_not_be_had(site, tmp_path, monkeypatch, capsys):
    entries = {"a": entry(CONTENT, site.url("/a.csv")), "b": entry(CONTENT, None, path="set/b.csv")}
    monkeypatch.setattr(module, "wanted", lambda names: entries)
    assert main(["--to", str(tmp_path)]) == 2
    said = capsys.readouterr()
    assert said.out.startswith("set/a.csv: from")
    assert said.err.startswith("set/b.csv: not downloaded")


def test_the_command_refuses_an_unknown_case(tmp_path, capsys):
    with pytest.raises(SystemExit, match="2"):
        main(["--to", str(tmp_path), "glider"])
    assert "glider: expected names of real recordings" in capsys.readouterr().err
