"""The shipped EDS and every way one can be wrong."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from canopen import import_od
from canopen.objectdictionary import ObjectDictionary
from hypothesis import given, settings, strategies as st

from drivers.capability.carrier import TPDO
from drivers.capability.plan import plan_drive
from drivers.datasheet.file import EdsFile
from drivers.datasheet.text import MAX_BYTES, EdsText, EdsUnreadable, Severity, read_eds_text
from drivers.datasheet.types import DATA_TYPES, DataType, Formula, read_formula, read_number
from drivers.eds_check import check_eds
from drivers.errors import ConfigMismatch
from drivers.resources import data_file

SHIPPED = data_file("inverter.eds")
FEEDBACK = (0x6041, 0x6077, 0x606C)

Edited = Callable[[str, str], EdsFile]


@pytest.fixture
def edited(tmp_path: Path) -> Edited:
    """Write the shipped EDS with one text replaced, and read it."""

    def edit(old: str, new: str) -> EdsFile:
        text = SHIPPED.read_text()
        if old not in text:
            raise AssertionError(f"{old!r} is not in {SHIPPED}")
        path = tmp_path / "edited.eds"
        path.write_text(text.replace(old, new))
        return EdsFile(path, 5)

    return edit


def values_of(dictionary: ObjectDictionary) -> dict[tuple[int, int], tuple[Any, ...]]:
    """Everything of a dictionary that decides what goes over the bus."""
    return {
        (index, variable.subindex): (
            variable.name,
            variable.data_type,
            variable.access_type,
            variable.pdo_mappable,
            variable.default,
            variable.min,
            variable.max,
        )
        for index, entry in dictionary.items()
        for variable in getattr(entry, "values", lambda entry=entry: (entry,))()
    }


def test_shipped_eds_has_nothing_to_remark() -> None:
    assert check_eds(SHIPPED).findings == ()


def test_shipped_eds_is_read_as_another_reader_reads_it() -> None:
    """The library's own reader, on a file without the habits that it can't take."""
    theirs, ours = values_of(import_od(str(SHIPPED), 5)), values_of(EdsFile(None, 5).dictionary)
    assert ours == theirs
    assert len(ours) > 50


def test_pdo_layouts_come_from_the_eds_with_the_node_id_put_in() -> None:
    layout = plan_drive(EdsFile(None, 5).sheet).pdos(TPDO)[0].layout
    assert (layout.cob_id, layout.transmission_type, layout.valid) == (0x185, 1, True)
    assert tuple(mapped.index for mapped in layout.objects) == FEEDBACK


def test_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigMismatch, match=r"none\.eds can't be read: No such file"):
        EdsFile(tmp_path / "none.eds", 5)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("not an EDS\n", "lists no object"),
        ("[1000]\nDataType=zero\n", "lists no object"),
        ("[1018sub1]\nParameterName=x\nDataType=7\n", "lists no object"),
        ("[1000\nDataType=0x7\n", r"can't be read: line 2, text: expected a section such as \[1000\], found '\[1000'"),
        (
            "[1000]\nDataType=0x7\nDataType=0x6\n",
            r"can't be read: line 4, \[1000\] DataType: expected this key once; line 3 has it with '0x7'",
        ),
    ],
)
def test_file_that_is_no_eds_is_refused(tmp_path: Path, content: str, said: str) -> None:
    path = tmp_path / "wrong.eds"
    path.write_text(f"[DeviceInfo]\n{content}")
    with pytest.raises(ConfigMismatch, match=rf"wrong\.eds {said}"):
        EdsFile(path, 5)


def test_object_that_is_not_in_the_eds_is_refused() -> None:
    with pytest.raises(ConfigMismatch, match="0x2000:00, found no such object"):
        EdsFile(None, 5).integer_type(0x2000)


def test_eds_without_a_pdo_for_the_objects_is_refused(edited: Edited) -> None:
    """The mapping is another one, and can't be changed, for the transmission type is fixed."""
    locked = (
        "[1A00sub2]\nParameterName=Mapped object 2\nObjectType=0x7\nDataType=0x0007\nAccessType={}\nDefaultValue={}"
    )
    eds = edited(locked.format("rw", "0x60770010"), locked.format("ro", "0x60780010"))
    with pytest.raises(
        ConfigMismatch, match=r"one TPDO or several that map .*0x6077.*found 0x1800: COB-ID 0x185.*0x1A00:02 can no"
    ):
        plan_drive(eds.sheet).pdos(TPDO)[0]


@pytest.mark.parametrize(
    ("kind", "text", "value"),
    [
        (0x01, "1", 1),
        (0x08, "2.5", 2.5),
        (0x08, "fast", None),
        (0x09, "TX-4", "TX-4"),
        (0x0A, "00 FF", b"\x00\xff"),
        (0x0A, "0x00FF", None),
        (0x0F, "@file", None),
    ],
)
def test_default_of_another_type_is_kept_as_the_library_wants_it(
    edited: Edited, kind: int, text: str, value: object
) -> None:
    """Its SDO server would stumble over any other."""
    section = (
        f"[2000]\nParameterName=x\nDataType=0x{kind:04X}\nAccessType=rw\nDefaultValue={text}\n\n[ManufacturerObjects]"
    )
    assert edited("[ManufacturerObjects]", section).dictionary.get_variable(0x2000).default == value


INTEGERS = [kind for kind in DATA_TYPES.values() if kind.is_integer]


@pytest.mark.parametrize(
    ("text", "number"),
    [
        ("0", 0),
        ("16", 16),
        ("0x10", 16),
        ("0X1f", 31),
        ("020", 16),
        ("00", 0),
        ("-1", -1),
        (" 7 ", 7),
        ("08", None),
        ("0x", None),
        ("", None),
        ("1.0", None),
        ("10h", None),
        ("1_000", None),
        ("０", None),
    ],
)
def test_number(text: str, number: int | None) -> None:
    assert read_number(text) == number


@given(st.integers(-(1 << 63), 1 << 64))
def test_every_number_is_read_back_from_all_three_ways_to_write_it(number: int) -> None:
    sign, size = ("-" if number < 0 else ""), abs(number)
    assert {read_number(f"{sign}{text}") for text in (f"{size}", f"0x{size:X}", f"0{size:o}")} == {number}


@pytest.mark.parametrize(
    ("text", "formula"),
    [
        ("$NODEID+0x180", Formula(0x180, of_node_id=True, hexadecimal=True)),
        ("$NODEID + 384", Formula(384, of_node_id=True)),
        ("0x180+$NodeId", Formula(0x180, of_node_id=True, hexadecimal=True)),
        ("$NODEID", Formula(0, of_node_id=True)),
        ("0x80000000+$NODEID+0x180", Formula(0x80000180, of_node_id=True, hexadecimal=True)),
        ("12", Formula(12)),
        ("$NODEID+$NODEID", None),
        ("$NODEID-1", None),
        ("$NODEID+", None),
        ("$NODE+1", None),
        ("", None),
    ],
)
def test_formula(text: str, formula: Formula | None) -> None:
    assert read_formula(text) == formula
    if formula is not None:
        assert formula.value(5) - formula.value(0) == (5 if formula.of_node_id else 0)


@pytest.mark.parametrize("kind", INTEGERS, ids=lambda kind: kind.name)
def test_integer_is_taken_up_to_the_ends_of_its_type_and_no_further(kind: DataType) -> None:
    for value in (kind.low, kind.high):
        assert kind.integer(str(value), 1) == value
    for value in (kind.low - 1, kind.high + 1):
        assert kind.integer(str(value), 1) is None


@pytest.mark.parametrize(("text", "value"), [("0xFFFF", -1), ("0x8000", -32768), ("0x7FFF", 32767), ("0x10000", None)])
def test_hexadecimal_number_is_the_bit_pattern(text: str, value: int | None) -> None:
    assert DATA_TYPES[0x03].integer(text, 1) == value


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
