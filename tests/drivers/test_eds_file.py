"""The shipped EDS and every way one can be wrong."""

from __future__ import annotations

import configparser
from collections.abc import Callable
from pathlib import Path

import pytest

from drivers import resources
from drivers.eds_file import EdsFile
from drivers.errors import ConfigMismatch
from drivers.resources import data_file
from drivers.scaling import IntegerType

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


def test_shipped_eds_is_formed_as_cia_306_has_it() -> None:
    """The object lists name exactly the objects described, and each description has its mandatory keys."""
    eds = configparser.RawConfigParser()
    eds.read(SHIPPED)
    listed = set()
    for section in ("MandatoryObjects", "OptionalObjects", "ManufacturerObjects"):
        count = eds.getint(section, "SupportedObjects")
        listed |= {int(eds.get(section, str(n + 1)), 16) for n in range(count)}
        assert len(eds.options(section)) == count + 1
    described = {name for name in eds.sections() if len(name) == 4}
    assert {int(name, 16) for name in described} == listed
    for name in described:
        subs = [sub for sub in eds.sections() if sub.startswith(f"{name}sub")]
        if eds.get(name, "ObjectType") == "0x7":
            assert not subs
            assert {"parametername", "datatype", "accesstype"} <= set(eds.options(name))
        else:
            assert eds.getint(name, "SubNumber") == len(subs)
    assert {"filename", "fileversion", "edsversion"} <= set(eds.options("FileInfo"))
    assert {"vendornumber", "productnumber", "nrofrxpdo", "nroftxpdo"} <= set(eds.options("DeviceInfo"))


def test_identity_of_device_info_and_identity_object_agree() -> None:
    eds = EdsFile(None, 5)
    device = eds.dictionary.device_information
    assert (device.vendor_number, device.product_number) == (eds.default(0x1018, 1), eds.default(0x1018, 2))


def test_pdo_layouts_come_from_the_eds_with_the_node_id_put_in() -> None:
    layout = EdsFile(None, 5).pdo_carrying(0x1800, 0x1A00, *FEEDBACK)
    assert (layout.cob_id, layout.transmission_type, layout.valid) == (0x185, 1, True)
    assert tuple(mapped.index for mapped in layout.objects) == FEEDBACK


def test_changed_mapping_changes_the_layout(edited: Edited) -> None:
    layout = edited("0x60770010", "0x60B20010").pdo_carrying(0x1800, 0x1A00, 0x6041, 0x60B2)
    assert tuple(mapped.index for mapped in layout.objects) == (0x6041, 0x60B2, 0x606C)


def test_types_hold_every_object_with_its_type() -> None:
    types = EdsFile(None, 5).types()
    assert types[0x606C, 0] is IntegerType.INTEGER32
    assert types[0x1018, 1] is IntegerType.UNSIGNED32
    assert types[0x6060, 0] is IntegerType.INTEGER8


def test_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigMismatch, match=r"none\.eds can't be read: No such file"):
        EdsFile(tmp_path / "none.eds", 5)


@pytest.mark.parametrize("content", ["not an EDS\n", "[1000]\nDataType=0x7\n", "[1018sub1]\nParameterName=x\n"])
def test_file_that_is_no_eds_is_refused(tmp_path: Path, content: str) -> None:
    path = tmp_path / "wrong.eds"
    path.write_text(f"[DeviceInfo]\n{content}")
    with pytest.raises(ConfigMismatch, match=r"wrong\.eds can't be read"):
        EdsFile(path, 5)


def test_empty_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "empty.eds"
    path.touch()
    with pytest.raises(ConfigMismatch, match=r"empty\.eds has no section \[DeviceInfo\]"):
        EdsFile(path, 5)


def test_file_without_objects_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "bare.eds"
    path.write_text("[DeviceInfo]\n")
    with pytest.raises(ConfigMismatch, match=r"bare\.eds lists no object"):
        EdsFile(path, 5)


def test_file_with_another_ending_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "inverter.txt"
    path.write_text(SHIPPED.read_text())
    with pytest.raises(ConfigMismatch, match=r"inverter\.txt can't be read"):
        EdsFile(path, 5)


def test_object_that_is_not_in_the_eds_is_refused() -> None:
    with pytest.raises(ConfigMismatch, match="0x2000:00, found no such object"):
        EdsFile(None, 5).integer_type(0x2000)


def test_object_that_is_no_integer_is_refused(edited: Edited) -> None:
    eds = edited("ParameterName=Device type\nObjectType=0x7\nDataType=0x0007", "ParameterName=Name\nDataType=9")
    with pytest.raises(ConfigMismatch, match="0x1000:00, found data type 0x0009"):
        eds.integer_type(0x1000)


def test_default_that_is_no_number_is_refused(edited: Edited) -> None:
    with pytest.raises(ConfigMismatch, match="0x60A9:00 has no readable DefaultValue"):
        edited("DefaultValue=0xFDB44700", "DefaultValue=fast").default(0x60A9)


def test_eds_without_a_pdo_for_the_objects_is_refused(edited: Edited) -> None:
    with pytest.raises(ConfigMismatch, match=r"one PDO from 0x1800 on that maps .*0x6077.*found COB-ID 0x185"):
        edited("0x60770010", "0x60B20010").pdo_carrying(0x1800, 0x1A00, *FEEDBACK)


def test_data_file_that_is_not_shipped_is_refused() -> None:
    with pytest.raises(ConfigMismatch, match=r"data file none\.eds: expected in .* or .*, found in neither"):
        data_file("none.eds")


def test_wheel_comes_before_checkout() -> None:
    """An installed package must not read a folder beside it."""
    assert resources._FOLDERS[0].parts[-2:] == ("drivers", "eds")
