"""Linear model of a plant near an operating point: matrices, signal names, poles and frequency response."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from importlib.util import find_spec
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ppafo.engine.lanes import Floats
from ppafo.errors import ScenarioError
from ppafo.simulation.scenario import Scenario
from ppafo.version import __version__
from ppafo.wording import known_names, one_line

MISSING_CONTROL = "a system for python-control needs the package control: pip install ppafo[control]"
_SINGULAR = 1.0e13
"""Condition number of a scaled matrix above which its solution has no correct digit (64-bit floats: 1e16)."""


@dataclass(frozen=True, slots=True)
class LinearSignal:
    """State, input or output: name, SI unit, and value at the operating point."""

    name: str
    unit: str
    value: float


@dataclass(frozen=True, slots=True)
class SlopeKink:
    """Kink of the plant at the operating point, where the slopes with respect to a state or input differ by side.

    ``name`` is the state or input. The linear model holds above its value at the operating point if ``is_above`` is
    true, else below.
    """

    name: str
    is_above: bool


@dataclass(frozen=True, slots=True)
class OmittedDelays:
    """Delays that the linear model omits [s].

    ``command``: dead time of the valve
    ``signals``: age of the measurements
    ``period``: sample period of the controller
    """

    command: float
    signals: float
    period: float


@dataclass(frozen=True, slots=True, repr=False)
class LoopMargins:
    """Margins of the control loop, closed by the scenario's PID; None where a crossover does not exist.

    Angles are in rad and frequencies in Hz, as in JSON; the report has degrees.

    ``is_stable``: True if the closed loop of the linear model is stable (Nyquist criterion)
    ``gain_margin``: factor on all gains at which the loop becomes unstable [-]
    ``phase_crossover``: frequency of the gain margin [Hz]
    ``phase_margin``: phase margin [rad]
    ``gain_crossover``: frequency of the phase margin, at which the loop gain is 1 [Hz]
    ``bandwidth``: lowest frequency at which the closed loop follows with 0.707 of its lowest-frequency response [Hz]
    ``peak_sensitivity``: largest sensitivity abs(1 / (1 + L)) [-]
    """

    is_stable: bool
    gain_margin: float | None
    phase_crossover: float | None
    phase_margin: float | None
    gain_crossover: float | None
    bandwidth: float | None
    peak_sensitivity: float

    def __repr__(self) -> str:
        """Return the margins with the units of their attributes; the phase margin in degrees too, as in the report."""
        units = dict.fromkeys(("phase_crossover", "gain_crossover", "bandwidth"), " Hz")
        units["phase_margin"] = f" rad ({np.degrees(self.phase_margin or 0.0):.3g} deg)"
        shown = (
            f"{name}={value:.4g}{units.get(name, '')}" if isinstance(value, float) else f"{name}={value}"
            for name, value in asdict(self).items()
        )
        return f"LoopMargins({', '.join(shown)})"


@dataclass(frozen=True, slots=True, eq=False)
class LinearModel:
    """Linear plant model of a scenario, x' = A x + B u, y = C x + D u, for deviations from the operating point in SI.

    ``time``: time of the operating point [s]; None for a steady state
    ``a`` (states, states), ``b`` (states, inputs), ``c`` (outputs, states), ``d`` (outputs, inputs): matrices, also
        named as in the equations: ``A``, ``B``, ``C``, ``D``
    ``rates`` (states,): x' at the operating point, 0 in a steady state
    ``sides``: side of each limit of the plant, in words
    ``edges``: kinks on which the operating point lies
    ``delays``: delays that the model omits
    ``margins``: margins of the loop with the scenario's controller and these delays; None unless it is a PID
    """

    scenario: Scenario
    time: float | None
    states: tuple[LinearSignal, ...]
    inputs: tuple[LinearSignal, ...]
    outputs: tuple[LinearSignal, ...]
    a: Floats
    b: Floats
    c: Floats
    d: Floats
    rates: Floats
    sides: Mapping[str, str]
    edges: tuple[SlopeKink, ...]
    delays: OmittedDelays
    margins: LoopMargins | None = None

    def __getattr__(self, name: str) -> Floats:
        """Matrix under its name in the equations: ``A``, ``B``, ``C`` or ``D``."""
        if name not in ("A", "B", "C", "D"):
            raise AttributeError(f"'{type(self).__name__}' object has no attribute '{name}'", name=name, obj=self)
        matrix: Floats = getattr(self, name.lower())
        return matrix

    @property
    def is_steady(self) -> bool:
        """True if the operating point of the model is a steady state."""
        return self.time is None

    @property
    def poles(self) -> NDArray[np.complex128]:
        """Poles of the linear model [1/s], the slowest first."""
        eigenvalues = np.linalg.eigvals(self.a).astype(np.complex128)
        return eigenvalues[np.argsort(np.abs(eigenvalues))]

    def response(self, frequencies: Floats, output: str = "torque", source: str = "command") -> NDArray[np.complex128]:
        """Return the complex frequency response (frequencies,) of an output to an input in SI; frequencies [Hz].

        Raises ScenarioError for an unknown output or input, and for a frequency at which the model has a pole.
        """
        row, column = _index_of(output, self.outputs, "output"), _index_of(source, self.inputs, "input")
        eye, responses = np.eye(len(self.states)), []
        for frequency in np.asarray(frequencies, dtype=np.float64).ravel().tolist():
            matrix = scaled = 2.0j * np.pi * frequency * eye - self.a
            # States and their rates differ by powers of ten in SI: rank is taken with rows and columns of one size.
            for axis in (1, 0):
                largest = np.max(np.abs(scaled), axis=axis, keepdims=True, initial=0.0)
                scaled = scaled / np.where(largest > 0.0, largest, 1.0)
            if np.linalg.cond(scaled) > _SINGULAR:
                raise ScenarioError(
                    f"{self.scenario.name}: the linear model has a pole at {frequency:g} Hz, where its response is "
                    f"infinite; give another frequency"
                )
            responses.append(self.c[row] @ np.linalg.solve(matrix, self.b[:, column]) + self.d[row, column])
        return np.array(responses, dtype=np.complex128)

    def json_document(self) -> dict[str, Any]:
        """Return operating point, matrices, poles and sides as plain data in SI."""
        rates = self.rates.tolist()
        return {
            "format": "ppafo linear model",
            "schema_version": 1,
            "ppafo": __version__,
            "scenario": self.scenario.name,
            "overrides": list(self.scenario.origin.overrides),
            "at": "equilibrium" if self.time is None else self.time,
            "states": [{**asdict(variable), "rate": rate} for variable, rate in zip(self.states, rates, strict=True)],
            "inputs": [asdict(variable) for variable in self.inputs],
            "outputs": [asdict(variable) for variable in self.outputs],
            "A": self.a.tolist(),
            "B": self.b.tolist(),
            "C": self.c.tolist(),
            "D": self.d.tolist(),
            "poles": [{"real": pole.real, "imaginary": pole.imag} for pole in self.poles.tolist()],
            "sides": dict(self.sides),
            "edges": [asdict(edge) for edge in self.edges],
            "left_out": {
                "command_delay": self.delays.command,
                "signal_delay": self.delays.signals,
                "sample_period": self.delays.period,
            },
            "margins": None if self.margins is None else asdict(self.margins),
        }

    def to_control(self) -> Any:
        """Return the model as a ``control.StateSpace`` with signal names.

        Raises ScenarioError if the extra ``control`` is not installed.
        """
        if find_spec("control") is None:
            raise ScenarioError(MISSING_CONTROL)
        import control

        names = {kind: [variable.name for variable in getattr(self, kind)] for kind in ("states", "inputs", "outputs")}
        return control.ss(self.a, self.b, self.c, self.d, name=self.scenario.name.replace("-", "_"), **names)


def _index_of(name: str, variables: Sequence[LinearSignal], kind: str) -> int:
    """Index of a signal by name; ``kind`` is the noun for the error message.

    Raises ScenarioError for an unknown name.
    """
    names = [variable.name for variable in variables]
    if name not in names:
        raise ScenarioError(f"the linear model has no {kind} '{one_line(name)}'{known_names(name, names)}")
    return names.index(name)
