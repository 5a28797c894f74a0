"""The shipped EDS and every way one can be wrong."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from canopen import import_od
from canopen.objectdictionary import ObjectDictionary

from drivers.capability.carrier import TPDO
from drivers.capability.plan import plan_drive
from drivers.datasheet.file import EdsFile
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
