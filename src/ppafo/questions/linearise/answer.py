"""The answer about a linear model: the point, the poles, the matrices, which sides were taken, how far it holds."""

import io
from collections.abc import Sequence
from typing import Any

import numpy as np

from ppafo.answers import Answer, Column, Figure, Section, Table
from ppafo.answers.display_units import QUANTITIES, quantity_of_unit, quantity_text
from ppafo.engine.lanes import Floats
from ppafo.questions.linearise.figure import frequency_figure, steps_figure
from ppafo.questions.linearise.solve import LinearModel, Variable
from ppafo.questions.linearise.steps import can_be_stepped
from ppafo.version import __version__

_FREQUENCY_CAPTION = (
    "The torque for a small sine of the command; dashed: with the dead time, the age of the measurements and half a "
    "sample period, which are not in the model."
)
_STEPS_CAPTION = (
    "Steps of the command from the steady state, on the lanes and of the linear model, in which the difference grows "
    "with the square of the amplitude."
)
_SEVERAL = 1.0e-6
"""Imaginary part of a pole, over its size, below which it is real."""


def answer_of(model: LinearModel) -> Answer:
    """Return the answer of a linear model."""
    answers = bool(np.any(model.b[:, 0]) or np.any(model.d[:, 0]))
    frequency = Figure("frequency-response", _FREQUENCY_CAPTION, lambda: frequency_figure(model)) if answers else None
    sections = [
        Section("The point", table=_point_table(model)),
        Section("Which side was taken", table=Table((), tuple(model.sides.items())), remarks=_edges(model)),
        Section("Poles", table=_pole_table(model), figure=frequency),
        *_matrices(model),
    ]
    if can_be_stepped(model):
        drawn = Figure("steps", _STEPS_CAPTION, lambda: steps_figure(model))
        sections.append(Section("How far it holds", figure=drawn))
    return Answer(
        name="linearise",
        kicker="Linear model",
        title=f"Linear model of {model.scenario.name}, {_when(model)}",
        lead=_lead(model),
        sections=tuple(sections),
        data=_data(model),
        files={"linearise.npz": lambda: _arrays(model)},
    )


def _when(model: LinearModel) -> str:
    return "in its steady state" if model.time is None else f"at {model.time:g} s"


def _lead(model: LinearModel) -> tuple[str, ...]:
    """What the model is, and what it leaves out."""
    size = f"{len(model.states)} states, {len(model.inputs)} inputs, {len(model.outputs)} outputs"
    said = [f"the plant without controller and sensors: {size}; differences from the point, SI units"]
    if model.time is not None:
        said.append(
            "the point is no steady state: the model is of small differences from the run itself, and holds only as "
            "long as the run stays near the point"
        )
    late = (
        ("dead time of the valve", model.delays.command),
        ("age of the measurements", model.delays.signals),
        ("sample period", model.delays.period),
    )
    left_out = ", ".join(f"{name} {1.0e3 * value:g} ms" for name, value in late if value > 0.0)
    return (*said, f"not in the model: {left_out}, noise, resolution and bandwidth of sensors")


def _shown(item: Variable) -> str:
    """A value in the unit in which a person is shown it."""
    quantity = quantity_of_unit(item.unit)
    if quantity in QUANTITIES:
        return quantity_text(item.value, quantity, ".5g")
    return f"{item.value:.5g} {'' if item.unit == '1' else item.unit}".rstrip()


def _point_table(model: LinearModel) -> Table:
    states = {item.name for item in model.states}
    kinds = (("state", model.states), ("input", model.inputs))
    rows = [(kind, item.name, item.unit, _shown(item)) for kind, items in kinds for item in items]
    rows += [("output", item.name, item.unit, _shown(item)) for item in model.outputs if item.name not in states]
    return Table((Column(""), Column("name"), Column("unit in the model"), Column("at the point")), tuple(rows), left=3)


def _edges(model: LinearModel) -> tuple[str, ...]:
    """Where the point lies on an edge of the plant, and what was taken to hold."""
    return tuple(
        f"the point lies on an edge, with another linear model beyond: `{edge.place.partition(': ')[2]}` in "
        f"{edge.place.partition(': ')[0]} was taken to be {'true' if edge.is_true else 'false'}"
        for edge in model.edges
    )


def _pole_table(model: LinearModel) -> Table:
    """Poles with their time constants; a pair of complex ones is one row with its frequency and damping."""
    rows: list[tuple[str | float | None, ...]] = []
    for pole in model.poles.tolist():
        size = abs(pole)
        if abs(pole.imag) <= _SEVERAL * size:
            rows.append((f"{pole.real:.5g}", None if pole.real == 0.0 else -1.0 / pole.real, None, None))
        elif pole.imag > 0.0:
            pair = f"{pole.real:.5g} ± {pole.imag:.5g}i"
            rows.append((pair, None, size / (2.0 * np.pi), -pole.real / size))
    head = (
        Column("pole (1/s)"),
        Column("time constant", "time", ".4g"),
        Column("frequency", "frequency", ".4g"),
        Column("damping ratio", "", ".3f"),
    )
    return Table(head, tuple(rows))


def _matrices(model: LinearModel) -> list[Section]:
    """A to D as tables, with the names of rows and columns."""
    return [
        Section(f"Matrix {name} (SI)", table=_matrix(values, rows, columns), is_detail=name in "CD")
        for name, values, rows, columns in (
            ("A", model.a, model.states, model.states),
            ("B", model.b, model.states, model.inputs),
            ("C", model.c, model.outputs, model.states),
            ("D", model.d, model.outputs, model.inputs),
        )
    ]


def _matrix(values: Floats, rows: Sequence[Variable], columns: Sequence[Variable]) -> Table:
    head = (Column(""), *(Column(item.name, "", ".5g") for item in columns))
    return Table(head, tuple((item.name, *row) for item, row in zip(rows, values.tolist(), strict=True)))


def _data(model: LinearModel) -> dict[str, Any]:
    rates = model.rates.tolist()
    return {
        "format": "ppafo linear model",
        "schema_version": 1,
        "ppafo": __version__,
        "scenario": model.scenario.name,
        "overrides": list(model.scenario.origin.overrides),
        "at": "equilibrium" if model.time is None else model.time,
        "states": [{**_variable(item), "rate": rate} for item, rate in zip(model.states, rates, strict=True)],
        "inputs": [_variable(item) for item in model.inputs],
        "outputs": [_variable(item) for item in model.outputs],
        "A": model.a.tolist(),
        "B": model.b.tolist(),
        "C": model.c.tolist(),
        "D": model.d.tolist(),
        "poles": [{"real": pole.real, "imaginary": pole.imag} for pole in model.poles.tolist()],
        "sides": dict(model.sides),
        "edges": [{"place": edge.place, "is_true": edge.is_true} for edge in model.edges],
        "left_out": {
            "command_delay": model.delays.command,
            "signal_delay": model.delays.signals,
            "sample_period": model.delays.period,
        },
    }


def _variable(item: Variable) -> dict[str, str | float]:
    return {"name": item.name, "unit": item.unit, "value": item.value}


def _arrays(model: LinearModel) -> bytes:
    """The matrices, names, units and values at the point as a NumPy archive."""
    arrays: dict[str, Any] = {"A": model.a, "B": model.b, "C": model.c, "D": model.d, "rates": model.rates}
    for kind in ("states", "inputs", "outputs"):
        items = getattr(model, kind)
        arrays[kind] = np.array([item.name for item in items])
        arrays[f"{kind}_units"] = np.array([item.unit for item in items])
        arrays[f"{kind}_values"] = np.array([item.value for item in items])
    written = io.BytesIO()
    np.savez(written, allow_pickle=False, **arrays)
    return written.getvalue()
