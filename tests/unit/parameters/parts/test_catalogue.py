"""The catalogue of parts: what comes with the package holds together, and every mistake in a file is one line."""

import math
import re
import tomllib
from pathlib import Path

import jsonschema
import pytest

from ppafo.errors import ParameterError
from ppafo.parameters.parts import load_catalogue
from ppafo.parameters.parts.catalogue import json_schema, parse_catalogue

SHIPPED = Path(__file__).parents[4] / "src" / "ppafo" / "parameters" / "parts" / "catalogues" / "parts.toml"
GOOD = """
schema_version = 1
name = "mine"
title = "Mine"

[bottles.small]
maker = "Somebody"
model = "S"
unknown = []

[bottles.small.content]
value = 99.0
unit = "g"
origin = "datasheet"
source = "label"

[bottles.small.empty_mass]
value = 175.0
unit = "g"
origin = "assumed"
source = "another bottle"
note = "scaled"
"""
VALVE = """
[valves.v]
kind = "proportional"
maker = "M"
model = "V"
[valves.v.mass]
value = 1.0
unit = "g"
origin = "datasheet"
source = "s"
"""


def test_the_shipped_catalogue_keeps_its_published_schema() -> None:
    validator = jsonschema.Draft202012Validator(json_schema())
    assert not list(validator.iter_errors(tomllib.loads(SHIPPED.read_text(encoding="utf-8"))))


def test_the_parts_of_the_paper_have_the_figures_that_it_prints() -> None:
    catalogue = load_catalogue()
    valve = catalogue.part("valves", "enfield-ls-v05s")
    assert (valve.values["area"], valve.figures["area"].origin) == (pytest.approx(31.6e-6), "published")
    assert catalogue.part("valves", "festo-vovg-5v-pair").values["area"] == pytest.approx(12.6e-6)
    actuator = catalogue.part("actuators", "smc-crb2bw40-90d")
    assert actuator.values["torque_constant"] == pytest.approx(1.451e-5)
    assert catalogue.part("bottles", "pipeline-jacpac-9oz").values["content"] == pytest.approx(0.255)


def test_sonic_conductances_follow_from_the_nominal_flows_beside_them() -> None:
    valves = [part for part in load_catalogue().parts if "nominal_flow" in part.values]
    assert len(valves) >= 4
    for valve in valves:
        upstream, downstream = 6.0e5 + 101325.0, 5.0e5 + 101325.0
        place = (downstream / upstream - valve.values["critical_ratio"]) / (1.0 - valve.values["critical_ratio"])
        expected = valve.values["nominal_flow"] / (upstream * math.sqrt(1.0 - place**2))
        assert valve.values["sonic_conductance"] == pytest.approx(expected, rel=1e-3), valve.name


def test_what_is_guessed_says_why_and_is_told_apart() -> None:
    parts = load_catalogue().parts
    guessed = [part.figures[name] for part in parts for name in part.doubtful]
    assert {figure.origin for figure in guessed} == {"quoted", "assumed"}
    assert all(figure.note for figure in guessed if figure.origin == "assumed")
    assert not set(load_catalogue().part("actuators", "smc-crb2bw40-90d").doubtful)


def test_a_full_bottle_weighs_its_gas_too() -> None:
    bottle = parse_catalogue(GOOD.encode(), "mine.toml").part("bottles", "small")
    assert bottle.full_mass == pytest.approx(0.274)
    assert bottle.doubtful == ("empty_mass",)


def test_a_part_that_is_not_there_is_answered_with_the_nearest() -> None:
    with pytest.raises(ParameterError, match=r"valves has no part 'enfield-ls-v5s', did you mean 'enfield-ls-v05s'\?"):
        load_catalogue().part("valves", "enfield-ls-v5s")


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        (
            'unit = "g"\norigin = "datasheet"',
            'unit = "mm"\norigin = "datasheet"',
            "content = 99 mm: unit 'mm' does not fit",
        ),
        ("value = 99.0", "value = -1.0", "content = -1 g: must be more than 0 g and at most 100000 g"),
        ("unknown = []", 'unknown = ["contents"]', "there is no value 'contents', did you mean 'content'?"),
        ("unknown = []", 'unknown = ["content"]', "'content' has a value in this part"),
        ('origin = "datasheet"', 'origin = "datashet"', "'datashet' is not allowed, did you mean 'datasheet'?"),
        ("[bottles.small.content]", "[bottles.small.contents]", "unknown key 'bottles.small.contents'"),
        (
            'title = "Mine"',
            f'title = "Mine"\n{VALVE}',
            "needs either area and discharge_coefficient or sonic_conductance",
        ),
    ],
)
def test_every_mistake_is_one_line_with_file_key_and_value(before: str, after: str, message: str) -> None:
    assert before in GOOD
    with pytest.raises(ParameterError, match=re.escape(message)) as caught:
        parse_catalogue(GOOD.replace(before, after, 1).encode(), "mine.toml")
    assert str(caught.value).startswith("mine.toml: ")
    assert "\n" not in str(caught.value)


def test_two_unknown_keys_of_a_table_list_the_allowed_keys_once() -> None:
    with pytest.raises(ParameterError) as caught:
        parse_catalogue(GOOD.replace('model = "S"', 'model = "S"\nheight = 1\nwidth = 2').encode(), "mine.toml")
    assert str(caught.value) == (
        "mine.toml: unknown key 'bottles.small.height'; unknown key 'bottles.small.width'; allowed here: maker, model, "
        "document, note, unknown, content, empty_mass"
    )


def test_a_cylinder_in_a_catalogue_is_told_what_is_sized_and_where_to_describe_it() -> None:
    figure = '{ value = 32.0, unit = "mm", origin = "datasheet", source = "its sheet" }'
    part = f'[actuators.own]\nmaker = "Acme"\nmodel = "C32"\nbore = {figure}\n'
    with pytest.raises(ParameterError) as caught:
        parse_catalogue(f"{GOOD}\n{part}".encode(), "mine.toml")
    assert "unknown key 'actuators.own.bore'" in str(caught.value)
    assert (
        "; 'ppafo design' sizes vanes only: write a cylinder as a parameter set ('ppafo new set NAME --from "
        "cylinder-lever') and search supply.pressure by 'ppafo find' with controller.kind=damped_proportional, or for "
        "a wearer try 'ppafo walk proportional' with device.set, wearer.body_mass, supply.pressure, controller.peak_"
    ) in str(caught.value)
    with pytest.raises(ParameterError) as caught:
        parse_catalogue(GOOD.replace('note = "scaled"', 'height = "scaled"').encode(), "mine.toml")
    assert "vanes" not in str(caught.value)


def test_every_key_that_parts_lack_is_in_one_refusal() -> None:
    # A source is the basis of an assumed figure: it needs no note.
    two = GOOD.replace('note = "scaled"', "").replace('title = "Mine"', f'title = "Mine"\n{VALVE}')
    two = two.replace('model = "S"', "")
    with pytest.raises(ParameterError) as caught:
        parse_catalogue(two.encode(), "mine.toml")
    lacking = [part.split(";")[0].split(": needs ")[0] for part in caught.value.parts]
    assert lacking == ["mine.toml: 'bottles.small.model' is missing", "mine.toml: valves.v"]
