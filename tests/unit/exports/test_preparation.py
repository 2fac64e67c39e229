"""Functions that prepare a run of a library, as Python runs them."""

import pytest

from ppafo.errors import ProgramError
from ppafo.exports import c_library
from ppafo.exports.c_library import library_of
from ppafo.exports.c_library.files import library_files
from ppafo.exports.c_library.preparation import VANE_PREPARATION, start
from ppafo.loading import load_scenario


def test_a_number_that_no_function_prepares_is_named_with_its_group(monkeypatch: pytest.MonkeyPatch) -> None:
    unstarted = tuple(function for function in VANE_PREPARATION if function is not start)
    monkeypatch.setattr(c_library, "VANE_PREPARATION", unstarted)
    said = r"preparation\.py:\d+: no preparation function sets 'result' \(LaneResult\) of the program"
    with pytest.raises(ProgramError, match=said):
        library_files(library_of(load_scenario("torque-task-proportional")))
