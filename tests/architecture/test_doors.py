"""Every kind and every key that adds a state, a history or a clock stands in the table of the suite of doors."""

import tomllib
from collections.abc import Iterator
from importlib import resources
from typing import Any

from ppafo.control.catalog import CONTROLLERS, PROFILES
from ppafo.control.walking.catalog import WALKING_CONTROLLERS
from ppafo.loading import load_scenario
from ppafo.model.catalog import ACTUATORS, EFFECTS, VALVES
from ppafo.model.controlled import CONTROLLED
from ppafo.parameters.loading import load_device
from ppafo.simulation.declaration import ACCURACY, RUN, SAMPLING, SEED, SENSORS, THERMAL_GAS, line_paths
from ppafo.simulation.motion_kind import MOTIONS
from ppafo.walking.declaration import WALK_SENSORS
from tests.doors.table import CASES, SHORT

TEXTS = frozenset(text for case in CASES for text in case.texts)
PATHS = frozenset(text.partition("=")[0] for text in TEXTS)


def own_names(kinds: Any) -> list[str]:
    """Kinds of this package: those of others are their authors' to try."""
    return [name for name in kinds if kinds.is_own(name)]


def words_of_files() -> frozenset[str]:
    """What the files of shipped scenarios and walks say, as overrides."""

    def said(section: str, content: Any) -> Iterator[str]:
        if isinstance(content, dict):
            for name, inner in content.items():
                yield from said(f"{section}.{name}" if section else name, inner)
        else:
            yield f"{section}={content}"

    files = [
        file
        for folder in (resources.files("ppafo") / "scenarios", resources.files("ppafo.walking") / "configurations")
        for file in folder.iterdir()
        if file.name.endswith(".toml")
    ]
    return frozenset(text for file in files for text in said("", tomllib.loads(file.read_text(encoding="utf-8"))))


def texts_of_kinds() -> list[str]:
    """An override for every kind of the catalogues, but of actuators, which stand in the files of sets."""
    wanted = {
        "device.valve": own_names(VALVES),
        "motion.kind": own_names(MOTIONS),
        "reference.of": [name for name in CONTROLLED if name != "torque"],
        "controller.kind": [*own_names(CONTROLLERS), *own_names(WALKING_CONTROLLERS)],
        "reference.kind": own_names(PROFILES),
    }
    return [f"{path}={name}" for path, names in wanted.items() for name in names]


def paths_of_keys() -> list[str]:
    """Every key of a file that adds a state, a history or a clock."""
    valves = {f"valve.{item.name}" for kind in map(VALVES.__getitem__, own_names(VALVES)) for item in kind.quantities}
    effects = {
        f"{EFFECTS[name].section}.{item.name}" for name in own_names(EFFECTS) for item in EFFECTS[name].quantities
    }
    sensors = {f"sensors.{item.name}" for item in (*SENSORS, *WALK_SENSORS, SEED)}
    gas = {f"gas_model.{item.name}" for item in THERMAL_GAS}
    clocks = {f"run.{item.name}" for item in (*RUN, ACCURACY)} | {f"controller.{item.name}" for item in SAMPLING}
    return sorted(valves | effects | sensors | gas | clocks | set(line_paths()))


def test_every_kind_of_the_catalogues_stands_in_the_table() -> None:
    said = TEXTS | words_of_files()
    assert [text for text in texts_of_kinds() if text not in said] == []


def test_every_actuator_stands_in_the_table() -> None:
    sets = {text.partition("=")[2] for text in TEXTS if text.startswith("device.set=")}
    names = {load_device(name).actuator.kind for name in sets if "muscle" not in name}
    assert {*own_names(ACTUATORS)} <= {*names, load_scenario(SHORT[0].scenario).device.actuator.kind}


def test_every_key_that_adds_a_state_a_history_or_a_clock_stands_in_the_table() -> None:
    assert [path for path in paths_of_keys() if path not in PATHS] == []
