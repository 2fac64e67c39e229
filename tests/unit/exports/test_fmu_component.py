"""A unit as a WebAssembly component, after the draft fmi-ls-wasm, run by wasmtime: the numbers of Python."""

import importlib.util
import io
import zipfile
from collections.abc import Callable
from typing import Any
from xml.etree import ElementTree as Xml

import numpy as np
import pytest

from ppafo.errors import ProgramError, ScenarioError
from ppafo.exports.fmu import closed_loop, component, functional_unit
from ppafo.running import simulate
from ppafo.simulation.loading import load_scenario

missing = [name for name in ("wasmtime", "ziglang") if importlib.util.find_spec(name) is None]
needs_both = pytest.mark.skipif(bool(missing), reason=f"not on this machine: {', '.join(missing)}")
INTERFACE = "fmi:fmi3/co-simulation@3.0.0"


class Component:
    """A component in wasmtime; ``told`` has the messages that it logged."""

    def __init__(self, binary: bytes) -> None:
        import wasmtime
        from wasmtime.component import Component as Loaded
        from wasmtime.component import Linker

        engine = wasmtime.Engine()
        self.told: list[tuple[Any, ...]] = []
        self.store = wasmtime.Store(engine)
        linker = Linker(engine)
        with linker.root() as root, root.add_instance("fmi:fmi3/callbacks@3.0.0") as callbacks:
            callbacks.add_func("log-message", lambda _store, *said: self.told.append(said))
        self.instance = linker.instantiate(self.store, Loaded(engine, binary))
        self.interface = self.instance.get_export_index(self.store, INTERFACE)

    def function(self, name: str) -> Callable[..., Any]:
        found = self.instance.get_func(self.store, self.instance.get_export_index(self.store, name, self.interface))
        assert found is not None, name
        return lambda *given: found(self.store, *given)

    def new(self, token: str, events: bool = False) -> Any:
        made = self.function(f"[static]{component.INSTANCE}.instantiate-co-simulation")
        return made("unit", token, False, True, events, False, [])

    def call(self, name: str, *given: Any) -> Any:
        return self.function(f"[method]{component.INSTANCE}.{name}")(*given)


@pytest.fixture(scope="module")
def unit() -> zipfile.ZipFile:
    contents = functional_unit(closed_loop(load_scenario("step-response")), 3, ["wasm32"])
    return zipfile.ZipFile(io.BytesIO(contents["step_response.fmu"]))


def loaded(unit: zipfile.ZipFile) -> tuple[Component, str, dict[str, int]]:
    description = Xml.fromstring(unit.read("modelDescription.xml"))
    references = {item.attrib["name"]: int(item.attrib["valueReference"]) for item in description.iter("Float64")}
    binary = unit.read("binaries/wasm32-wasip2/step_response.wasm")
    return Component(binary), description.attrib["instantiationToken"], references


def begun(own: Component, token: str) -> Any:
    made = own.new(token)
    assert own.call("enter-initialization-mode", made, None, 0.0, None) == "ok"
    assert own.call("exit-initialization-mode", made) == "ok"
    return made


@needs_both
def test_every_output_at_every_sample_has_the_bits_of_python(unit: zipfile.ZipFile) -> None:
    own, token, references = loaded(unit)
    recording = simulate("step-response").recording
    names = [name for name in references if name in recording.names]
    assert len(names) > 8
    made, found = begun(own, token), []
    for number in range(len(recording)):
        found.append(own.call("get-float64", made, [references[name] for name in names]))
        if number + 1 < len(recording):
            assert own.call("do-step", made, number * 1e-3, 1e-3, True).__dict__["early-return"] is False
    for name, values in zip(names, np.array(found).T, strict=True):
        assert values.tobytes() == recording[name].tobytes(), name


@needs_both
def test_a_state_that_is_restored_goes_on_as_before_in_another_instance(unit: zipfile.ZipFile) -> None:
    own, token, references = loaded(unit)
    first, second = begun(own, token), begun(own, token)
    own.call("do-step", first, 0.0, 0.05, True)
    state = own.call("get-fmu-state", first)
    asked = [references["pressure_1"], references["angle"]]
    own.call("do-step", first, 0.05, 0.05, True)
    assert own.call("set-fmu-state", second, state) == "ok"
    own.call("do-step", second, 0.05, 0.05, True)
    assert own.call("get-float64", first, asked) == own.call("get-float64", second, asked)


@needs_both
def test_what_is_wrong_is_logged_and_a_status(unit: zipfile.ZipFile) -> None:
    own, token, references = loaded(unit)
    assert own.new("another token") is None
    made = begun(own, token)
    assert own.call("get-float32", made, []) == []
    assert own.call("get-float32", made, [1]) == "error"
    assert own.call("set-string", made, [1, 2], ["a", "bc"]) == "error"
    assert own.call("set-float64", made, [references["gas.molar_mass"]], [0.03]) == "error"
    assert own.told[-1] == ("unit", "error", "logStatusError", "parameter gas.molar_mass is fixed once the unit runs")


@needs_both
def test_the_archive_is_as_the_draft_has_it(unit: zipfile.ZipFile) -> None:
    manifest = Xml.fromstring(unit.read("extra/org.modelica.fmi-ls-wasm/manifest.xml"))
    name = "{http://fmi-standard.org/fmi-ls-manifest}fmi-ls-name"
    assert (manifest.tag, manifest.attrib[name]) == ("fmiLayeredStandardManifest", "org.modelica.fmi-ls-wasm")
    assert len(component.METHODS) == 56
    own, _, _ = loaded(unit)
    assert all(own.function(f"[method]{component.INSTANCE}.{method}") for method in component.METHODS)


def test_without_wasmtime_it_is_said_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(component.importlib.util, "find_spec", lambda _name: None)
    with pytest.raises(ProgramError, match=r"needs the package wasmtime \(pip install 'ppafo\[component\]'\)"):
        component.component_of(b"")


def test_fmi_2_has_no_such_platform() -> None:
    with pytest.raises(ScenarioError, match="platform wasm32 has no name in FMI 2: take --fmi 3"):
        functional_unit(closed_loop(load_scenario("step-response")), 2, ["wasm32"])
