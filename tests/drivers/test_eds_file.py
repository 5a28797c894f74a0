"""The shipped EDS and every way one can be wrong."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from canopen import import_od
from canopen.objectdictionary import ObjectDictionary

from drivers import resources
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


def test_empty_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "empty.eds"
    path.touch()
    with pytest.raises(ConfigMismatch, match=r"empty\.eds has no section \[DeviceInfo\]"):
        EdsFile(path, 5)


def test_object_that_is_not_in_the_eds_is_refused() -> None:
    with pytest.raises(ConfigMismatch, match="0x2000:00, found no such object"):
        EdsFile(None, 5).integer_type(0x2000)


def test_object_that_is_no_integer_is_refused(edited: Edited) -> None:
    eds = edited("ParameterName=Device type\nObjectType=0x7\nDataType=0x0007", "ParameterName=Name\nDataType=9")
    with pytest.raises(ConfigMismatch, match="0x1000:00, found data type 0x0009"):
        eds.integer_type(0x1000)


@pytest.mark.parametrize("written", ["fast", "0x1FDB44700", ""])
def test_value_that_is_no_number_or_does_not_fit_is_none(edited: Edited, written: str) -> None:
    assert edited("DefaultValue=0xFDB44700", f"DefaultValue={written}").sheet.value(0x60A9) is None


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


def test_spare_pdo_without_defaults_is_no_hindrance(edited: Edited) -> None:
    """Vendors describe four PDOs of each kind and leave blank what they don't use."""
    blank = "[1A00sub0]\nParameterName=Number of mapped objects\nObjectType=0x7\nDataType=0x0005\nAccessType=rw\n"
    second = SHIPPED.read_text().partition("[1800]\n")[2].partition("[6007]\n")[0]
    second = "[1800]\n" + second
    spare = second.replace(f"{blank}DefaultValue=3", f"{blank}DefaultValue=")
    moved = second.replace("[1800", "[1801").replace("[1A00", "[1A01")
    carrier = plan_drive(edited(second, spare + moved).sheet).pdos(TPDO)[0]
    assert carrier.layout.communication_index == 0x1801
    assert not carrier.mapped_here


def test_pdo_without_a_transmission_type_is_mapped_anew(edited: Edited) -> None:
    head = "[1800sub2]\nParameterName=Transmission type\nObjectType=0x7\nDataType=0x0005\nAccessType=rw\n"
    carrier = plan_drive(edited(f"{head}DefaultValue=1\n", head).sheet).pdos(TPDO)[0]
    assert (carrier.mapped_here, carrier.described, carrier.layout.transmission_type) == (True, None, 1)


def test_data_file_that_is_not_shipped_is_refused() -> None:
    with pytest.raises(ConfigMismatch, match=r"data file none\.eds: expected in .* or .*, found in neither"):
        data_file("none.eds")


def test_wheel_comes_before_checkout() -> None:
    """An installed package must not read a folder next to it."""
    assert resources._FOLDERS[0].parts[-2:] == ("drivers", "eds")
