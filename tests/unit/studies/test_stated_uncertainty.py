"""Distributions that the parameter set states: value and half width of the 95 % interval."""

from collections.abc import Callable
from importlib import resources
from pathlib import Path
from typing import Any

import pytest

from ppafo.errors import StudyError
from ppafo.studies.loading import load_study


@pytest.fixture
def stating(varying: Callable[..., Any], tmp_path: Path) -> Callable[..., Any]:
    """A study of one path with kind "stated", over a set that states two uncertainties beside its scenario."""
    text = (resources.files("ppafo") / "parameters" / "sets" / "ppafo2011.toml").read_text(encoding="utf-8")
    for value in ("value = 1.451e-5\n", "[supply.pressure]\nvalue = 50.0\n"):
        assert text.count(value) == 1
    text = text.replace("value = 1.451e-5\n", "value = 1.451e-5\nuncertainty = 0.02e-5\n")
    text = text.replace("[supply.pressure]\nvalue = 50.0\n", "[supply.pressure]\nvalue = 50.0\nuncertainty = 3.0\n")
    (tmp_path / "mine.toml").write_text(text.replace('"ppafo2011"', '"mine"', 1), encoding="utf-8")
    scenario = (resources.files("ppafo") / "scenarios" / "torque-task-proportional.toml").read_text(encoding="utf-8")
    (tmp_path / "task.toml").write_text(scenario.replace('"ppafo2011"', '"mine.toml"', 1), encoding="utf-8")

    def study(path: str, *overrides: str) -> Any:
        document = varying({"path": path, "kind": "stated"})
        own = {"name": "mine", "scenario": str(tmp_path / "task.toml"), "overrides": list(overrides)}
        document["configurations"] = [own]
        return document

    return study


def test_the_deviation_is_the_half_width_over_1_96(stating: Callable[..., Any]) -> None:
    drawn = load_study(stating("actuator.torque_constant")).drawn[0].distribution
    assert drawn.kind == "normal"
    assert drawn.numbers[0] == pytest.approx(1.451e-5, rel=1e-12)
    assert drawn.numbers[1] == pytest.approx(0.02e-5 / 1.959964, rel=1e-6)


def test_an_uncertainty_of_a_gauge_pressure_is_a_difference(stating: Callable[..., Any]) -> None:
    drawn = load_study(stating("supply.pressure")).drawn[0].distribution
    assert drawn.kind == "normal"
    assert drawn.numbers[0] == pytest.approx(101325.0 + 50.0 * 6894.757, rel=1e-6)
    assert drawn.numbers[1] == pytest.approx(3.0 * 6894.757 / 1.959964, rel=1e-6)


@pytest.mark.parametrize(
    ("path", "overrides", "expected"),
    [
        ("valve.area", (), "needs an uncertainty in the parameter set 'mine.toml', but it states none"),
        ("supply.pressure", ("supply.pressure=40 psi_g",), "an override replaced it"),
        ("reference.level", (), "but it states none"),
    ],
)
def test_what_the_set_does_not_state_is_refused(
    stating: Callable[..., Any], path: str, overrides: tuple[str, ...], expected: str
) -> None:
    with pytest.raises(StudyError, match=expected):
        load_study(stating(path, *overrides))
