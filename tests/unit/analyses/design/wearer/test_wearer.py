"""From a wearer to a device: the parts that are chosen walk as they are printed, or the answer says what to give up."""

import re
import shlex
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import ppafo
from ppafo.analyses.design.wearer import solve as wearer
from ppafo.analyses.design.wearer.electrical import electrical_of, valve_power
from ppafo.analyses.design.wearer.solve import WearerSizing, finding_of
from ppafo.cli.main import main
from ppafo.errors import StudyError
from ppafo.parameters.parts import load_catalogue
from ppafo.parameters.parts.catalogue import Catalogue
from ppafo.progress import report_nothing
from ppafo.report.finding import text_of
from ppafo.signals import Channel, Recording

PSI = 6894.757


@cache
def few() -> Catalogue:
    """Two valves and the paper's actuator, with a small and a large bottle, so that the search is short."""
    whole = load_catalogue()
    kept = {
        "valves": ("festo-vovg-5v-pair", "festo-mpye-5-m5-010-b"),
        "actuators": ("smc-crb2bw40-90d",),
        "bottles": ("co2-3_5oz", "pipeline-jacpac-9oz"),
    }
    groups = {
        group: {name: part for name, part in parts.items() if group not in kept or name in kept[group]}
        for group, parts in whole.groups.items()
    }
    return Catalogue(whole.file, whole.name, whole.title, whole.notes, groups)


@pytest.fixture
def little(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(wearer, "load_catalogue", few)


def sized(torque: float, minutes: float, pressure: float = 50.0) -> WearerSizing:
    supply = 101325.0 + pressure * PSI
    found = ppafo.design(mass=72.5, stature=1.75, torque=torque, pressure=supply, minutes=minutes).found
    assert isinstance(found, WearerSizing)
    return found


@pytest.mark.usefixtures("little")
def test_what_is_suggested_is_the_walk_that_is_shown(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    found = sized(2.5, 1.0)
    device = found.device
    assert device is not None
    assert device.torque >= 0.9 * 2.5
    assert device.life.discharge.walking_time >= 60.0
    assert device.bottle.name == "co2-3_5oz", "the lightest bottle that lasts"
    said = text_of(finding_of(found))
    assert device.command in said.splitlines()
    # The printed command walks the same walk, with the same torque.
    words = shlex.split(device.command)[1:]
    assert main([*words, "--out", str(tmp_path / "again")]) == 0
    shown, again = (
        re.search(r"peak torque .*, (\S+) N m in the last", text) for text in (said, capsys.readouterr().out)
    )
    assert shown is not None
    assert again is not None
    assert again[1] == shown[1]
    life = ppafo.endurance_of_walk(device.walked)
    assert life is not None
    assert life.discharge.walking_time == device.life.discharge.walking_time


@pytest.mark.usefixtures("little")
def test_where_nothing_does_it_what_is_offered_is_granted_when_it_is_asked_for() -> None:
    too_strong, too_long = sized(5.0, 8.0), sized(2.5, 30.0)
    for found in (too_strong, too_long):
        assert found.device is None
        assert not finding_of(found).passed
    changes = [line.partition(":")[0] for line in (*too_strong.instead, *too_long.instead)]
    assert changes == [
        "less torque, fewer minutes",
        "more pressure, fewer minutes",
        "less torque, less pressure",
        "less pressure, fewer minutes",
    ]
    line = too_strong.instead[2]
    words = re.search(r": (\S+) N m at (\S+) psi_g for (\S+) min with (\S+) and (\S+) on (\S+)$", line)
    assert words is not None, line
    torque, pressure, minutes = (float(word) for word in words.groups()[:3])
    again = sized(torque, minutes, pressure=pressure).device
    assert again is not None, line
    assert again.life.discharge.walking_time >= minutes * 60.0


def test_a_pressure_that_wastes_gas_is_answered_with_less_pressure_and_that_is_granted() -> None:
    parts = few().groups
    valve, actuator, bottle = (
        parts["valves"]["festo-vovg-5v-pair"],
        parts["actuators"]["smc-crb2bw40-90d"],
        parts["bottles"]["co2-3_5oz"],
    )
    wish = wearer.Wish(72.5, 1.75, 1.2, 101325.0 + 80.0 * PSI, 150.0)
    tried = wearer._few_strides(wish, valve, actuator)
    assert tried[0].torque > 1.2
    assert wearer._lightest(wish, tried, [bottle], report_nothing) is None
    (offer,) = wearer._instead(wish, tried, [bottle], report_nothing)
    words = re.fullmatch(r"less pressure: 1.2 N m at (\S+) psi_g for 2.5 min with .* on co2-3_5oz", offer)
    assert words is not None, offer
    asked = wearer.Wish(72.5, 1.75, 1.2, 101325.0 + float(words[1]) * PSI, 150.0)
    assert wearer._lightest(asked, wearer._few_strides(asked, valve, actuator), [bottle], report_nothing) is not None


def test_the_limit_of_the_controller_follows_the_wish_and_a_stature_that_is_assumed_is_said() -> None:
    catalogue = load_catalogue()
    valve, actuator = (
        catalogue.part("valves", "enfield-ls-v05s"),
        catalogue.part("actuators", "smc-crb2bw40-90d"),
    )
    wish = wearer.Wish(60.0, None, 5.0, 101325.0 + 60.0 * PSI, 60.0)
    found = wearer._few_strides(wish, valve, actuator)
    assert found[0].torque >= 5.0
    assert "(assumed: give --stature)" in text_of(finding_of(WearerSizing(wish, tuple(found), None, ())))


@pytest.mark.parametrize(
    "change",
    [{"mass": 5.0}, {"mass": 400.0}, {"pressure": 9.0e4}, {"torque": 0.0}, {"minutes": 90.0}, {"stature": 0.9}],
)
def test_what_no_walk_can_be_asked_is_refused(change: dict[str, float]) -> None:
    wanted = {"mass": 70.0, "stature": 1.7, "torque": 2.0, "pressure": 4.5e5, "minutes": 5.0}
    with pytest.raises(StudyError, match=f"--{next(iter(change))}"):
        ppafo.design(**{**wanted, **change})


def test_coils_and_spool_take_the_power_of_their_command() -> None:
    catalogue = load_catalogue()
    pair, spool = (catalogue.part("valves", name) for name in ("festo-vovg-5v-pair", "festo-mpye-5-m5-010-b"))
    command = np.array([0.0, 1.0, -1.0, 2.0, 0.5])
    assert valve_power(pair, command).tolist() == [0.0, 1.0, 1.0, 0.0, 1.0]
    assert valve_power(spool, command).tolist() == [2.0, 20.0, 20.0, 2.0, 11.0]


def test_a_battery_has_as_many_cells_as_the_minutes_take() -> None:
    catalogue = load_catalogue()
    time = np.linspace(0.0, 10.0, 101)
    half = np.where(time < 5.0, 1.0, 0.0)
    channels = {"command": Channel(half, "-"), "safe_state": Channel(np.zeros(101), "-")}
    recording = Recording("walk", time, channels)
    parts = [catalogue.part("valves", "festo-vovg-5v-pair"), catalogue.part("processors", "msp430g2553")]
    cell = catalogue.part("batteries", "ncr18650b")
    found = electrical_of(recording, parts[0], 0.5, parts[1], cell, 600.0)
    assert found.powers == pytest.approx({"valve": 0.5, "shut-off valve": 0.5, "processor": 0.03})
    assert found.cells == 1
    assert found.lasts == pytest.approx(0.8 * 43.4e3 / 1.03)
    long = electrical_of(recording, parts[0], 0.5, parts[1], cell, 100.0 * 3600.0)
    assert long.cells == 11
    assert long.mass == pytest.approx(11 * 0.0485)
    assert long.lasts >= 100.0 * 3600.0 > long.lasts * 10.0 / 11.0
