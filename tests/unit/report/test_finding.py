"""A finding: numbers in SI become text, tables, JSON and figures in one place."""

from dataclasses import dataclass
from pathlib import Path

import pytest

from ppafo.errors import ArgumentError
from ppafo.report.finding import Column, Finding, Section
from ppafo.report.kind import TIME, ConfidenceInterval, Kind, of_metric, of_path
from ppafo.report.panels import SHAPES, Mark, Panel
from ppafo.report.writing import align_columns


@dataclass(frozen=True)
class Numbers:
    """What is found."""

    gas: list[float]


def test_a_kind_says_a_level_a_difference_and_an_interval_in_the_unit_of_the_field() -> None:
    pressure, gas = of_path("supply.pressure", "Pa_a", ".4g"), of_metric("gas_supplied")
    assert pressure.text(101325.0) == "0 psi_g"
    assert pressure.change(6894.757) == "1 psi"
    assert pressure.axis == "Supply pressure (psig)"
    assert gas.interval(ConfidenceInterval(0.001, 0.0005, 0.002)) == "1 [0.5, 2]"
    assert Kind("Switchings").text(3.0) == "3"
    with pytest.raises(ArgumentError, match=r"no quantity '\.4g'; give the format as form="):
        Kind("Torque", "torque", ".4g")


def finding() -> Finding[Numbers]:
    """A finding with a table of everything that a cell may be, and a panel."""
    gas = of_metric("gas_supplied")
    columns = [
        Column("run", ["a", "b", "c"]),
        Column("gas", [0.001, ConfidenceInterval(0.002, 0.001, 0.003), float("nan")], gas),
    ]
    panel = Panel(TIME, gas, [Mark("line", [0.0, 1.0], [0.001, 0.002], label="gas")])
    part = Section("Gas", columns, panels=[panel], name="gas", caption="Gas over time.")
    return Finding("trial", "Trial", "A trial", ["said"], [part], Numbers([0.001, float("nan")]))


def test_a_finding_is_text_json_page_figure_and_folder(tmp_path: Path) -> None:
    found = finding()
    assert str(found) == "said\n\nGas\nrun   gas (g)\na           1\nb    2 [1, 3]\nc           -"
    folded = align_columns([("run", "gas", "work"), ("a", "1", "2")], 1, 12)
    assert folded == ["run  gas", "a      1", "", "run  work", "a       2"]
    assert found.to_dict() == {"gas": [0.001, None]}
    (axes,) = found.plot().axes
    assert axes.get_ylabel() == "Gas supplied (g)"
    assert axes.lines[0].get_ydata().tolist() == pytest.approx([1.0, 2.0])
    assert found._repr_html_().startswith("<iframe srcdoc=")
    found.save(tmp_path / "out")
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert names == {"gas.png", "gas.svg", "ppafo.json", "report.html", "trial.json", "trial.txt"}
    assert "<script" not in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")


def test_every_shape_can_be_drawn() -> None:
    x, ends = [0.0, 1.0, 2.0], [[0.0, 0.0, 0.0], [1.0, 2.0, 1.0]]
    given = {
        "line": Mark("line", x, x),
        "reach": Mark("reach", x, x, [0.1, 0.1, 0.1]),
        "bars": Mark("bars", [*x, 3.0], x),
        "band": Mark("band", x, ends),
        "span": Mark("span", (0.0, 1.0)),
        "level": Mark("level", (), 1.0),
        "at": Mark("at", 1.0),
        "map": Mark("map", x, x[:2], [x, x]),
        "points": Mark("points", x, x, x),
        "text": Mark("text", 1.0, 1.0, label="words"),
    }
    assert set(given) == set(SHAPES)
    panels = [Panel(Kind("x"), Kind("y"), [mark], scale=Kind("z")) for mark in (given["map"], given["points"])]
    panels += [Panel(Kind("x"), Kind("y"), [given[name]]) for name in SHAPES if name not in ("map", "points")]
    part = Section("Shapes", panels=panels, name="shapes", across=4)
    figure = Finding("trial", "", "", [], [part], Numbers([])).plot()
    bars = [axes for axes in figure.axes if axes.get_label() == "<colorbar>"]
    assert [bar.get_ylabel() for bar in bars] == ["z"], "two panels of one scale share its bar"
    assert len(figure.axes) == len(bars) + 10


def test_an_interval_has_as_many_digits_as_tell_its_limits_apart() -> None:
    kind = Kind("", "", form=".3g")
    assert kind.interval(ConfidenceInterval(0.25, 0.2499, 0.2501)) == "0.25 [0.2499, 0.2501]"
    change = Kind("", "", form="+.2g")
    assert change.change_interval(ConfidenceInterval(0.07293, 0.0728, 0.0731)) == "+0.0729 [+0.0728, +0.0731]"
    assert kind.interval(ConfidenceInterval(0.0, 0.0, 0.0)) == "0 [0, 0]"
    assert kind.interval(ConfidenceInterval(1.0, 0.9, 1.1)) == "1 [0.9, 1.1]"
    assert kind.interval(ConfidenceInterval(1.0, 1.0 - 1e-12, 1.0 + 1e-12)) == "1 [1, 1]"
