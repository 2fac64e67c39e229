"""Scenarios in the text of a file that lies nowhere."""

from collections.abc import Iterable

from ppafo.errors import ScenarioError
from ppafo.parameters.overrides import read_overrides
from ppafo.simulation.document import DocumentReader
from ppafo.simulation.loading import FILE, VANE, scenario_of
from ppafo.simulation.scenario import Scenario


def parse_scenario(content: bytes, file: str, overrides: Iterable[str] = ()) -> Scenario:
    """Return the scenario in the bytes of a TOML file; ScenarioError or ParameterError for what cannot be used."""
    document = FILE.parse(content, file).document
    given = read_overrides(overrides, ScenarioError)
    return scenario_of(DocumentReader(file, document, path=file, overrides=given), VANE)
