"""While a command imports nothing is collected, and the collector is as it was afterwards."""

import gc

import pytest

from hil.cli.importing import without_collecting


@pytest.mark.parametrize("enabled", [True, False])
@pytest.mark.parametrize("fails", [True, False])
def test_the_collector_is_as_it_was(enabled: bool, fails: bool) -> None:
    (gc.enable if enabled else gc.disable)()
    try:
        with pytest.raises(ImportError) if fails else without_collecting(), without_collecting():
            assert not gc.isenabled()
            if fails:
                raise ImportError
        assert gc.isenabled() is enabled
    finally:
        gc.enable()
