"""What the door makes of values that people have: dictionaries, generators, NumPy numbers, one text, a path."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pint
import pytest
import xarray

import ppafo
from ppafo.arguments import Count, Fraction, Mass, Overrides, Point, Threads, Word, checked
from ppafo.cli.main import main
from ppafo.errors import ArgumentError, DataError, StudyError
from ppafo.wording import argument_text

TASK = "torque-task-proportional"


@checked
def walked(
    mass: Mass,
    *,
    overrides: Overrides = (),
    draws: Count = 10,
    at: Point = "equilibrium",
    share: Fraction = 0.5,
    threads: Threads | None = None,
    names: Annotated[Sequence[str], Word("NAME")] = (),
    is_whole: bool = False,
    file: str | Path = "x",
) -> dict[str, Any]:
    """Return what arrived."""
    return locals()


@pytest.mark.parametrize(
    ("given", "arrived"),
    [
        ({"mass": "72.5 kg"}, {"mass": 72.5}),
        ({"mass": np.float32(72.5)}, {"mass": 72.5}),
        ({"mass": np.array(72.5)}, {"mass": 72.5}),
        ({"mass": 1, "draws": np.int64(3)}, {"draws": 3}),
        ({"mass": 1, "is_whole": np.bool_(True)}, {"is_whole": True}),
        ({"mass": 1, "share": "95%"}, {"share": 0.95}),
        ({"mass": 1, "names": "rms_error"}, {"names": ("rms_error",)}),
        ({"mass": 1, "names": iter(["a", "b"])}, {"names": ("a", "b")}),
        ({"mass": 1, "file": Path("a.toml")}, {"file": Path("a.toml")}),
        ({"mass": 1, "overrides": "a.b=2 mm"}, {"overrides": ("a.b=2 mm",)}),
        ({"mass": 1, "overrides": (text for text in ["a=1", "b=2"])}, {"overrides": ("a=1", "b=2")}),
        (
            {"mass": 1, "overrides": {"a.b": "2 mm", "c": {"d": 4.0, "e": True}, "n": np.int64(3)}},
            {"overrides": ("a.b=2 mm", "c.d=4.0 SI", "c.e=true", "n=3 SI")},
        ),
        ({"mass": 1, "threads": None}, {"threads": None}),
        # What carries a unit is converted, whoever's it is.
        ({"mass": xarray.DataArray(725.0, attrs={"units": "hg"})}, {"mass": 72.5}),
        ({"mass": pint.UnitRegistry().Quantity(72.5, "kilogram")}, {"mass": 72.5}),
        ({"mass": pint.UnitRegistry().Quantity(np.array(72500), "g")}, {"mass": 72.5}),
        ({"mass": ppafo.Metric(72.5, "kg", "")}, {"mass": 72.5}),
        ({"mass": 1, "at": xarray.DataArray(1500.0, attrs={"units": "ms"})}, {"at": 1.5}),
        ({"mass": 1, "share": xarray.DataArray(0.5, attrs={"units": "1"})}, {"share": 0.5}),
        (
            {"mass": 1, "overrides": {"valve.area": pint.UnitRegistry().Quantity(3, "mm^2")}},
            {"overrides": ("valve.area=3.0 mm ** 2",)},
        ),
    ],
)
def test_a_value_arrives_as_the_function_takes_it(given: dict[str, Any], arrived: dict[str, Any]) -> None:
    found = walked(**given)
    assert {name: found[name] for name in arrived} == arrived
    assert {name: type(found[name]) for name in arrived} == {name: type(value) for name, value in arrived.items()}


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"mass": -1}, "mass=-1: must be a number in kg, above 0 kg, or a text with its unit such as '1 kg'"),
        ({"mass": "-3 kg"}, "mass: -3 kg: must be above 0 kg"),
        ({"mass": 1, "threads": -1}, "threads=-1: must be a whole number, 1 or more"),
        ({"mass": 1, "is_whole": "False"}, "is_whole='False': must be True or False"),
        ({"mass": 1, "names": ["a", 2]}, "names[1]=2: must be a text"),
        ({"mass": 1, "overrides": {"a": float("nan")}}, "overrides: a = nan: must be a finite number in SI units"),
        ({"mass": 1, "file": ""}, "file='': must be a text or a path"),
        ({"mass": xarray.DataArray(1.0, attrs={"units": "m"})}, "mass: 1.0 m: unit 'm' does not fit"),
        ({"mass": xarray.DataArray(1.0, attrs={"units": "1"})}, "mass: 1.0 1: unit '1' does not fit"),
        ({"mass": 1, "share": pint.UnitRegistry().Quantity(0.5, "kg")}, "share: 0.5 kg: must be a number from 0 to 1"),
        ({"mass": 1, "draws": pint.UnitRegistry().Quantity(3, "s")}, "draws=<Quantity>: must be a whole number"),
        ({"mass": "1 kg" + "g" * 10_000}, "mass: 1 kgggg"),
    ],
)
def test_another_value_is_refused_by_name(given: dict[str, Any], said: str) -> None:
    with pytest.raises(ArgumentError) as caught:
        walked(**given)
    assert str(caught.value).startswith(said)


def test_outputs_of_the_package_keep_their_unit_at_every_door() -> None:
    result = ppafo.simulate(TASK, ["run.duration=0.3 s"])
    used = result.metrics["gas_supplied"]
    table = result.dataset(units={"supplied_mass": "mg"})["supplied_mass"]
    by_door = [str(ppafo.bottle(gas_per_stride=gas, stride_time=1.0)) for gas in (used, table[-1])]
    assert by_door == [str(ppafo.bottle(gas_per_stride=f"{used.value!r} kg", stride_time=1.0))] * 2
    for values in (table, pint.UnitRegistry().Quantity(table.values, "mg")):
        with pytest.raises(DataError, match="in 'kg' carry the unit 'mg'"):
            result.recording.with_channel("supplied_mass", values, "kg")
    same = result.recording.with_channel(
        "supplied_mass", result.dataset(units={"supplied_mass": "kg"})["supplied_mass"], "kg"
    )
    assert same == result.recording


def test_a_number_among_overrides_is_in_si_units_and_a_text_has_its_own() -> None:
    by_texts = ppafo.simulate(TASK, ["supply.pressure=70 psi_g", "reference.level=4 N m"])
    by_dictionary = ppafo.simulate(TASK, {"supply.pressure": "70 psi_g", "reference.level": 4.0})
    assert by_dictionary.metrics["rms_error"].value == by_texts.metrics["rms_error"].value
    supply = ppafo.load_device("ppafo2011", overrides={"supply": {"pressure": 4.0e5}}).supply
    assert supply.pressure == 4.0e5
    assert ppafo.load_scenario(TASK, {"sensors.seed": 3}).sensors.seed == 3


def test_a_name_is_taken_wherever_an_object_is() -> None:
    assert ppafo.audit("ppafo2011") == ppafo.audit(ppafo.load_parameter_set("ppafo2011"))
    assert [run.scenario.name for run in ppafo.simulate_many([TASK, ppafo.load_scenario("step-response")])] == [
        TASK,
        "step-response",
    ]
    assert [run.scenario.name for run in ppafo.simulate_many(TASK)] == [TASK]


def test_an_error_about_the_content_of_an_argument_begins_with_its_name() -> None:
    with pytest.raises(StudyError, match=r"^vary: 'nonsense' is not of the form"):
        ppafo.find(TASK, vary="nonsense", such_that="rms_error <= 1 N m")


def test_a_message_names_arguments_in_python_and_options_on_the_command_line(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with pytest.raises(ppafo.ParameterError, match=r"gas_per_stride='0.3 g'$"):
        ppafo.bottle()
    assert main(["bottle"]) == 2
    assert "--gas-per-stride '0.3 g'" in capsys.readouterr().err
    # A command leaves nothing behind for a caller in Python.
    assert argument_text("peak_flow") == "peak_flow"
