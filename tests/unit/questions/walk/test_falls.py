"""Who falls when something fails: counts of falls with and without the safe state, of a wearer who reacts."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from ppafo.control.walking.signs import SAFETY_QUANTITIES
from ppafo.errors import SimulationError
from ppafo.progress import Progress
from ppafo.questions.walk import falls
from ppafo.questions.walk.falls import SHUT, WITH, WITHOUT, answer_of, falls_of_walk
from ppafo.questions.walk.risks import SAYS, causes_of
from ppafo.simulation.scenario import Scenario
from ppafo.walking import load_walk


def test_falls_are_counted_after_the_fault_for_each_safeguard(monkeypatch: pytest.MonkeyPatch) -> None:
    """Planted: stuck sensors topple three of eight at once without checks; with them one after 2 s."""
    begins = np.tile(4.0 + np.array([0.0, 0.25, 0.5, 0.75]), 2)

    def planted(scenario: Scenario, cause: Any) -> Any:
        nobody = np.full(8, np.nan)
        if cause is None:
            off = scenario.control.kind == "off"
            return begins if off else nobody
        if cause.kind != "stuck" or cause.part not in ("heel", "toe", "angle"):
            return nobody
        checked = scenario.control.settings["largest_force"] < 1e5
        return np.where(np.arange(8) < (1 if checked else 3), begins + (2.0 if checked else 0.5), np.nan)

    monkeypatch.setattr(falls, "_fall_times", planted)
    told: list[Progress] = []
    found = falls_of_walk(load_walk("reacting"), told.append)
    assert (found.walks, found.sound, found.vented) == (8, 0, 8)
    by_cause = {(item.part, item.kind): item for item in found.falls}
    assert dict(by_cause["heel", "stuck"].falls) == {WITHOUT: 3, WITH: 1, SHUT: 1}
    assert by_cause["toe", "stuck"].soonest[WITHOUT] == pytest.approx(0.5)
    assert by_cause["valve_1", "stuck"].soonest[WITH] is None
    answer = answer_of(found)
    assert SAYS in answer.lead
    said = " ".join(answer.sections[0].remarks)
    assert "without a fault 0 of 8 fall, with the device off (vented) 8" in said
    assert "fewer falls for 3 causes, more for 0" in said
    assert told[-1].done == len(found.falls)


def test_without_the_safe_state_every_limit_is_as_wide_as_it_may_be() -> None:
    widest = falls._without_checks(load_walk("reacting")).control.settings
    quantities = {item.name: item for item in SAFETY_QUANTITIES}
    assert widest["largest_force"] == quantities["largest_force"].maximum
    assert widest["lowest_angle"] == quantities["lowest_angle"].minimum
    assert widest["shortest_swing"] == 0.0
    assert widest["swing_angle"] == load_walk("reacting").control.settings["swing_angle"]


def test_a_walk_that_cannot_run_is_no_fall() -> None:
    walk = load_walk("reacting")
    settings = {**walk.control.settings, "flat_from": 0.6}
    with pytest.raises(SimulationError, match=r"flat_from: must be below controller\.flat_to"):
        falls._fall_times(replace(walk, control=replace(walk.control, settings=settings)), None)


@pytest.mark.long
def test_a_wearer_who_needs_the_device_falls_with_a_hose_that_is_off() -> None:
    settings = ["wearer.reacts=healthy-128", "wearer.tibialis_strength=0.1", "supply.dorsiflexion_pressure=32 psi_g"]
    weak, healthy = (load_walk("reacting", ["run.duration=13 s", *words]) for words in (settings, settings[:1]))
    (off,) = (item for item in causes_of(weak) if (item.part, item.kind) == ("hose_2", "off"))
    times = {
        name: falls._fall_times(falls.failing(walk, off, 4.0), off) for name, walk in (("w", weak), ("h", healthy))
    }
    assert np.isfinite(times["w"]).all()
    assert (times["w"] > 4.0).all()
    assert np.isnan(times["h"]).all()
