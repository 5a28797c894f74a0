"""The text of an EDS: line numbers, oddities that are borne, and files that are no text of an EDS at all."""

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.datasheet.file import EdsFile
from drivers.datasheet.text import MAX_BYTES, EdsText, EdsUnreadable, Severity, read_eds_text
from drivers.eds_check import check_eds
from drivers.errors import ConfigMismatch


def read(folder: Path, content: str | bytes) -> EdsText:
    path = folder / "file.eds"
    path.write_bytes(content.encode("latin-1") if isinstance(content, str) else content)
    return read_eds_text(path)


def reported(text: EdsText) -> list[tuple[str, int | None, str]]:
    return [(each.severity.value, each.line, each.found) for each in text.findings]


@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_sections_and_keys_have_the_lines_they_stand_in(tmp_path: Path, end: str) -> None:
    text = read(tmp_path, end.join(["; a comment", "[A]", "", "one = 1 ; the first", "[b]", "Two=x;y", ""]))
    assert text.findings == ()
    assert [(section.name, section.line) for section in text.sections.values()] == [("A", 2), ("b", 5)]
    first, second = text.section("a"), text.section("B")
    assert first is not None
    assert second is not None
    assert (first.get("ONE"), first.line_of("one")) == ("1", 4)
    assert (second.get("two"), second.line_of("two")) == ("x;y", 6)
    assert (second.get("three"), second.line_of("three")) == (None, 5)


@pytest.mark.parametrize(
    ("content", "findings"),
    [
        ("stray=1\n[A]\n", [("warning", 1, "'stray=1'")]),
        ("[A]\nno equals sign\n", [("warning", 2, "'no equals sign'")]),
        ("[A]\n=1\n", [("warning", 2, "'=1'")]),
        ("[A]\n# remark\n", [("warning", 2, "one with #")]),
        ("[A] rest\n", [("warning", 1, "'rest'")]),
        ("[A] ; rest\n", []),
        ("[A]\nx=1\n\n[a]\ny=2\n", [("warning", 4, "a second one; the first is in line 1")]),
        ("[A]\nx=1\nX=1\n", [("warning", 3, "it again")]),
        ("[A]\nx=1\nX=2\n", [("error", 3, "it again with '2'")]),
        ("[2100sub1]\nx=1\nX=2\n", [("warning", 3, "it again with '2'")]),
        (
            "[A]\nx=1\n[A]\nx=2\n",
            [("warning", 3, "a second one; the first is in line 1"), ("error", 4, "it again with '2'")],
        ),
        ("[A]\n[B\nx=1\n", [("error", 2, "'[B'")]),
        ("[]\n", [("error", 1, "'[]'")]),
        ("[A]\nx=\xfcber\ny=\xfc\n", [("note", 2, "other characters, first here")]),
        ("[A]\rx=1\r", [("warning", 1, "CR alone")]),
        ("[A]\r\nx=1\n", [("note", 2, "CR LF and LF mixed, first here")]),
        (f"[A]\nx={'y' * 300}\n", [("note", 2, "302")]),
        (b"\xef\xbb\xbf[A]\nx=1\n", [("warning", 1, "a UTF-8 byte order mark")]),
    ],
)
def test_what_is_odd_is_reported_with_its_line(
    tmp_path: Path, content: str | bytes, findings: list[tuple[str, int, str]]
) -> None:
    assert reported(read(tmp_path, content)) == findings


def test_first_of_two_keys_counts(tmp_path: Path) -> None:
    section = read(tmp_path, "[A]\nx=1\nx=2\n[A]\nx=3\ny=4\n").section("A")
    assert section is not None
    assert (section.get("x"), section.get("y")) == ("1", "4")


BAD = {
    "binary": (bytes(range(256)), "a byte 0 in line 1"),
    "executable": (b"\x7fELF\x02\n\n\0", "a byte 0 in line 3"),
    "UTF-16": ("[DeviceInfo]\n".encode("utf-16"), "UTF-16 text"),
    "UTF-16 without a mark": ("[DeviceInfo]\n".encode("utf-16-le"), "a byte 0 in line 1"),
    "too large": (b"[A]\n" + b" " * MAX_BYTES, "more than 16 MB"),
}


@pytest.mark.parametrize(("content", "said"), BAD.values(), ids=BAD)
def test_file_that_is_no_text_is_refused(tmp_path: Path, content: bytes, said: str) -> None:
    with pytest.raises(EdsUnreadable, match=rf"file\.eds can't be read: .*{said}.* Expected an EDS"):
        read(tmp_path, content)
    report = check_eds(tmp_path / "file.eds")
    assert not report.usable
    assert said in report.findings[0].found
    with pytest.raises(ConfigMismatch, match=said):
        EdsFile(tmp_path / "file.eds", 5)


@pytest.mark.parametrize("content", ["", "; nothing but a comment\n", "schema = 1\n[can]\nurl = 'x'\n"])
def test_file_of_another_kind_is_one_error(tmp_path: Path, content: str) -> None:
    path = tmp_path / "file.eds"
    path.write_text(content)
    (finding,) = check_eds(path).findings
    assert (finding.severity, finding.found) == (Severity.ERROR, "none")
    assert "objects" in finding.expected


@settings(max_examples=40)
@given(st.binary(max_size=400))
def test_no_file_is_too_odd_to_be_answered(tmp_path_factory: pytest.TempPathFactory, content: bytes) -> None:
    """Whatever the bytes: a report, and never an error of this program."""
    path = tmp_path_factory.getbasetemp() / "any.eds"
    path.write_bytes(content)
    assert not check_eds(path).usable


SECTIONS = ["[1000]", "[1018sub1]", "[1400]", "[1600]", "[1600sub0]", "[DeviceInfo]", "[1003Name]", "[OptionalObjects]"]
KEYS = ["ObjectType", "DataType", "DefaultValue", "LowLimit", "CompactSubObj", "SubNumber", "PDOMapping", "1"]
VALUES = ["", "0x7", "9", "09", "$NODEID+1", "-1", "0xFFFFFFFFFF", "[", "nonsense"]
LINES = st.sampled_from(SECTIONS) | st.builds("{}={}".format, st.sampled_from(KEYS), st.sampled_from(VALUES))


@settings(max_examples=40)
@given(st.lists(LINES, max_size=30))
def test_no_mixture_of_eds_lines_is_too_odd_either(tmp_path_factory: pytest.TempPathFactory, lines: list[str]) -> None:
    path = tmp_path_factory.getbasetemp() / "mixed.eds"
    path.write_text("\n".join(["[6071]", "DataType=3", *lines]))
    assert not check_eds(path).usable
