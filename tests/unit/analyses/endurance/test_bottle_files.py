"""Files of bottles: those of the package, overrides, and mistakes in one line."""

import re
from importlib import resources
from pathlib import Path

import pytest

import ppafo
from ppafo.errors import ParameterError
from ppafo.parameters.bottles.bottle import PAPER_BOTTLE, list_bottles, load_bottle
from ppafo.report.finding import text_of

TEXT = (resources.files("ppafo.parameters.bottles") / "files" / f"{PAPER_BOTTLE}.toml").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", list_bottles())
def test_every_bottle_is_whole_and_says_why_each_value_is_what_it_is(name: str) -> None:
    bottle = load_bottle(name)
    assert bottle.name == name
    assert bottle.mass > 0.0
    assert all(entry.source for entry in bottle.entries.values())


def test_what_the_paper_prints_of_its_bottle_is_published_and_nothing_else() -> None:
    bottle = load_bottle(PAPER_BOTTLE)
    published = {path for path, entry in bottle.entries.items() if entry.origin == "published"}
    assert bottle.mass == pytest.approx(0.255)
    assert published == {"bottle.gas_mass", "regulator.set_pressure", "room.temperature"}


def test_a_value_is_replaced_and_a_pressure_replaces_a_mass() -> None:
    assert load_bottle(PAPER_BOTTLE, ["bottle.gas_mass=100 g"]).mass == pytest.approx(0.1)
    filled = load_bottle("air-48ci-3000psi", ["bottle.gas_mass=50 g"])
    assert filled.mass == pytest.approx(0.05)
    assert "bottle.fill_pressure" not in filled.entries


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("bottle.volum=1 L", "did you mean 'bottle.volume'"),
        ("bottle.volume=1 kg", "does not fit"),
        ("bottle.volume=0 L", "must be at least"),
        (
            "bottle.volume=300 cm^3",
            "255 g of CO2 do not fit into bottle.volume = 300 cm^3 at 298 K, but 213.8 g",
        ),
        ("room.temperature=40 degC", "must be above 216.592 K and at most 303.9 K"),
        ("regulator.set_pressure=70 bar_g", "the regulator needs 7"),
        ("regulator.set_pressure=50 psi", "needs the kind of pressure"),
    ],
)
def test_overrides_that_cannot_be_are_refused_in_one_line(override: str, words: str) -> None:
    with pytest.raises(ParameterError, match=re.escape(words)) as caught:
        load_bottle(PAPER_BOTTLE, [override])
    assert "\n" not in str(caught.value)


def test_liquid_cannot_be_filled_by_pressure(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match=r"give bottle.gas_mass instead"):
        load_bottle(filled_by_pressure(tmp_path, 70.0))


def test_gas_above_no_liquid_can_be_filled_by_pressure(tmp_path: Path) -> None:
    bottle = load_bottle(filled_by_pressure(tmp_path, 30.0))
    assert bottle.mass / bottle.volume == pytest.approx(66.0, rel=0.05)


def filled_by_pressure(tmp_path: Path, pressure: float) -> Path:
    """The paper's bottle, filled with CO2 to a pressure [bar absolute] at room temperature."""
    start, end = TEXT.index("[bottle.gas_mass]"), TEXT.index("[bottle.volume]")
    entry = '[bottle.{0}]\nvalue = {1}\nunit = "{2}"\norigin = "assumed"\nsource = "test"\n\n'
    filled = entry.format("fill_pressure", pressure, "bar_a") + entry.format("fill_temperature", 298.0, "K")
    path = tmp_path / "mine.toml"
    path.write_text(TEXT[:start] + filled + TEXT[end:], encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("name", "mass", "volume"), [("co2-12g", 12.0, 17.6), ("co2-16g", 16.0, 23.5), ("co2-88g", 88.0, 129.0)]
)
def test_a_cartridge_is_filled_as_transport_rules_allow_and_lasts_seconds(
    name: str, mass: float, volume: float
) -> None:
    bottle = load_bottle(name)
    assert (1.0e3 * bottle.mass, 1.0e6 * bottle.volume) == pytest.approx((mass, volume))
    assert bottle.mass / bottle.volume == pytest.approx(680.0, rel=0.01)
    said = text_of(ppafo.bottle(gas_per_stride="0.4 g", stride_time="1.1 s", bottle=name))
    assert ("min of walking" in said) == (name == "co2-88g")
