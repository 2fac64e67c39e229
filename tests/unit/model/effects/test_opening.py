"""Opening of a valve as a table: its inverse, what a run makes of it, and its forms in a set."""

from pathlib import Path

import numpy as np
import pytest

import ppafo
from ppafo.errors import ParameterError
from ppafo.model.effects.opening import EFFECT, NODES, OpeningTable, opening_of_size, prepare, size_of_opening
from ppafo.parameters import load_device
from ppafo.simulation.ensemble import run_ensemble

NODES_OF_A_SPOOL = ((0.05, 0.0), (0.3, 0.1), (0.5, 0.1), (0.8, 0.9))
"""Closed up to 0.05, and flat in the middle."""
OF_A_SPOOL = tuple(
    f"effects.opening.{name}_{number:02}={value}"
    for number, node in enumerate(NODES_OF_A_SPOOL, 1)
    for name, value in zip(("command", "opening"), node, strict=True)
)


def table_of(rows: list[tuple[float, float]]) -> OpeningTable:
    return prepare(EFFECT.settings(*np.resize([*np.ravel(rows), *[0.0] * 2 * NODES], 2 * NODES).tolist()), None)


@pytest.mark.parametrize("seed", range(20))
def test_a_drawn_table_is_read_between_its_nodes_and_inverted(seed: int) -> None:
    chance = np.random.default_rng(seed)
    count = int(chance.integers(1, NODES + 1))
    commands = np.sort(chance.uniform(0.01, 0.99, count))
    openings = np.sort(chance.uniform(0.0, 1.0, count))
    openings[: count // 3] = 0.0
    rows = list(zip(commands.tolist(), openings.tolist(), strict=True))
    sizes = np.linspace(0.0, 1.0, 101)
    expected = np.interp(sizes, [0.0, *commands, 1.0], [0.0, *openings, 1.0])
    found = [opening_of_size(size, table_of(rows)) for size in sizes.tolist()]
    assert found == pytest.approx(expected.tolist(), abs=1e-12)
    again = [opening_of_size(size_of_opening(opening, table_of(rows)), table_of(rows)) for opening in found]
    assert again == pytest.approx(found, abs=1e-9)


def test_nodes_out_of_order_are_refused_and_a_falling_draw_fails() -> None:
    falls = ["effects.opening.command_01=0.3", "effects.opening.command_02=0.5", "effects.opening.opening_01=0.4"]
    with pytest.raises(ParameterError, match=r"opening_01 = 0.4 must be at most"):
        ppafo.load_scenario("torque-task-proportional", falls)
    base = ppafo.load_scenario("torque-task-proportional", [*falls, "effects.opening.opening_02=0.5"])
    found = run_ensemble(base, {"effects.opening.opening_02": np.array([0.6, 0.1])}, ["rms_error"])
    assert np.isfinite(found.metrics["rms_error"]).tolist() == [True, False]


@pytest.mark.parametrize("name", ["torque-task-proportional", "torque-task-slow-valve"])
def test_a_law_that_inverts_the_table_moves_the_joint_as_with_a_straight_valve(name: str) -> None:
    level = "reference.level=3 N m"
    straight, curved = (ppafo.simulate(name, [level, *more]) for more in ((), OF_A_SPOOL))
    assert curved.recording["torque"] == pytest.approx(straight.recording["torque"], abs=2e-3)
    assert np.abs(curved.recording["command"] - straight.recording["command"]).max() > 0.1


def test_a_constant_command_opens_the_valve_by_the_table_and_is_not_inverted() -> None:
    law = ["controller.kind=constant", "motion.kind=locked", "motion.angle=75 deg", "run.duration=0.2 s"]
    opened = ppafo.simulate("step-response", [*law, "controller.command=0.65", *OF_A_SPOOL])
    straight = ppafo.simulate("step-response", [*law, "controller.command=0.5"])
    assert opened.recording["pressure_1"] == pytest.approx(straight.recording["pressure_1"], rel=1e-12)


def test_rows_and_a_file_are_the_same_numbers_and_a_wrong_table_says_its_row(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    shipped = Path(ppafo.__file__).parent / "parameters" / "sets" / "ppafo2011.toml"
    text = shipped.read_text(encoding="utf-8")

    def effects(table: str) -> dict[str, float]:
        said = f'[valves.proportional.opening]\n{table}\norigin = "datasheet"\nsource = "figure 4"\n\n'
        path.write_text(text.replace("[valves.solenoid]", said + "[valves.solenoid]", 1), encoding="utf-8")
        return dict(load_device(path).effects["opening"])

    (tmp_path / "wrong.csv").write_text("command,opening\n\n0.1,0\n\n0.3,0.4,9\n0.5,x\n", encoding="utf-8")
    (tmp_path / "o.csv").write_text("opening,command\n0,0\n0,0.05\n0.4,0.5\n1,1\n", encoding="utf-8")
    rows = effects("command = [0.05, 0.5]\nopening = [0.0, 0.4]")
    assert rows == effects('file = "o.csv"')
    assert [rows[name] for name in ("command_01", "command_02", "opening_02", "command_03")] == [0.05, 0.5, 0.4, 0.0]
    for table, said in (
        ("command = [0.2, 0.5]\nopening = [0.3, 0.1]", r"row 2, command 0.5 with opening 0.1, .* from 0.3 to 1"),
        ("command = [0.2]\nopening = [0.3, 0.1]", "1 commands and 2 openings"),
        ("command = [0.5, 1.0]\nopening = [0.3, 0.9]", "at command 1 it is 1"),
        ("command = 0.5\nopening = [0.3]", r"command = 0.5 must be a list of numbers$"),
        ("command = [0.5, 0.4, 0.3]\nopening = [0.3, 0.4, 0.5]", r"^2 things are wrong: .* row 2, .* row 3,"),
        ('file = "wrong.csv"', r"^2 .*line 5: has 3 values, the header has 2; .*line 6: opening = 'x' is not a finite"),
        ('file = "absent.csv"', r"absent\.csv: cannot be read"),
    ):
        with pytest.raises(ParameterError, match=said):
            effects(table)
