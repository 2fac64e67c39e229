"""What every door needs: the packages of the examples, installed, and a compiler for units that is quick."""

import sys
from collections.abc import Iterator

import pytest

from ppafo.control.catalog import CONTROLLERS
from ppafo.exports.fmu import platforms
from ppafo.model.catalog import ACTUATORS
from tests.doors.of_python import compiled_result, scenario_of
from tests.doors.table import ROOT
from tests.page_code import write_package

EXAMPLES = ROOT / "src" / "ppafo" / "examples"
PACKAGES = {"add-an-actuator": "my_actuators.muscle_pair", "add-a-controller": "my_laws.hysteresis"}


@pytest.fixture(scope="module")
def quick_units() -> Iterator[None]:
    """Build units by gcc without optimisation: the quickest way, and strict arithmetic has the same bits."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(platforms, "compiler_for", lambda _name: ["gcc"])
        patch.setattr(platforms, "FLAGS", ("-std=c99", "-O0", "-ffp-contract=off", "-fwrapv"))
        yield


@pytest.fixture(scope="module", autouse=True)
def _installed(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """An actuator and a law of others, as an installer leaves them."""
    folder = tmp_path_factory.mktemp("installed")
    known = [(kinds, set(kinds.loaded())) for kinds in (ACTUATORS, CONTROLLERS)]
    for example, module in PACKAGES.items():
        text = (EXAMPLES / example / f"{module.replace('.', '/')}.py").read_text(encoding="utf-8")
        write_package(folder, module, text, (EXAMPLES / example / "pyproject.toml").read_text(encoding="utf-8"))
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(folder)
        yield
    for kinds, names in known:
        for name in set(kinds.loaded()) - names:
            del kinds[name]
    for name in [name for name in sys.modules if name.split(".")[0] in ("my_actuators", "my_laws")]:
        del sys.modules[name]
    # What was kept of these modules is not that of the next ones.
    for kept in (scenario_of, compiled_result):
        kept.cache_clear()
