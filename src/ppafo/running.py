"""Execution of scenarios by name, file or object: a vane alone or a walking leg."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, final

from ppafo.arguments import Overrides, Threads, checked
from ppafo.arguments.values import accepted_values, shown
from ppafo.counterfactuals import verdict_of
from ppafo.engine.run import batch_of
from ppafo.errors import ArgumentError, SimulationError
from ppafo.loading import scenario_or_load
from ppafo.model.sensors import GaitMeasurement, Measurement
from ppafo.model.valves.kind import VENT
from ppafo.plugins import Plugins
from ppafo.simulation import simulate as of_loaded
from ppafo.simulation.contradictions import check_no_bottle
from ppafo.simulation.plan import plan_run
from ppafo.simulation.python_controller import SampledRun
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.simulate import Result, result_of

_NUMBER = accepted_values(float)


@checked
def simulate(scenario: Scenario | str | Path, overrides: Overrides = (), *, plugins: Plugins = ()) -> Result:
    """Run one scenario: a task, or a walk with the device.

    A walk is simulated with the device only; ``compare_walks`` also simulates the same walk without it.

    Arguments:
        scenario: a Scenario, the name of a shipped one, or a .toml file
        overrides: texts as on the command line, ``["supply.pressure=70 psi_g"]``, or a dictionary,
            ``{"supply.pressure": "70 psi_g", "reference.level": 4.0}``, in which a number is in SI
        plugins: modules of your own, files or names, whose objects files may name:
            ``["laws.py"]`` for ``kind = "laws:KIND"``

    Returns:
        a Result: status, recording and metrics in SI units; a run that diverged has this status, and its recording ends
        at the time of failure

    Raises:
        ScenarioError: a scenario that cannot be used
        ParameterError: a parameter set, or a value of it, that cannot be used

    >>> import ppafo
    >>> result = ppafo.simulate("torque-task-proportional", {"reference.level": 4.0})
    >>> print(f"{result.metrics['rms_error'].value:.3f} N m")
    0.196 N m
    """
    return replace(of_loaded.simulate(scenario_or_load(scenario, overrides)), tries=verdict_of)


@checked
def simulate_many(
    scenarios: Sequence[Scenario | str | Path], *, threads: Threads | None = None, plugins: Plugins = ()
) -> list[Result]:
    """Run many scenarios in parallel, each with the result of a single run.

    Arguments:
        scenarios: Scenario objects, names of shipped ones, or .toml files
        threads: number of threads; default: all cores
        plugins: modules of your own, files or names, whose objects files may name

    Returns:
        the Result of each scenario, in their order

    Raises:
        ScenarioError: a scenario that cannot be used
        ParameterError: a parameter set, or a value of it, that cannot be used

    >>> import ppafo
    >>> runs = ppafo.simulate_many(["torque-task-proportional", "torque-task-solenoid"])
    >>> [f"{run.metrics['gas_supplied'].value:.2e} kg" for run in runs]
    ['4.16e-04 kg', '1.16e-03 kg']
    """
    results = of_loaded.simulate_many([scenario_or_load(scenario) for scenario in scenarios], threads)
    return [replace(result, tries=verdict_of) for result in results]


class GivenCommands:
    """Controller that repeats the commands [-] of a stepped run as they are, and then holds the last one."""

    def __init__(self) -> None:
        self.commands: list[float] = []
        self._sample = 0

    def reset(self) -> None:
        """Begin at the first command."""
        self._sample = 0

    def update(self, time: float, reference: float, measurement: GaitMeasurement) -> float:  # noqa: ARG002 - a protocol
        """Return the command of the next sample."""
        self._sample += 1
        return self.commands[min(self._sample, len(self.commands)) - 1]


@final
class SteppedRun:
    """Run in progress whose commands the caller gives, sample by sample; made by ``start``.

    ``period`` is the time between two samples [s]; ``measurement`` the sensor readings at the present one, a
    ``Measurement``, or in a walk a ``GaitMeasurement``.
    """

    def __init__(self, scenario: Scenario) -> None:
        self._given = GivenCommands()
        self._scenario = scenario.controlled_by(self._given)
        self._planned = plan_run(self._scenario)
        batch = batch_of(self._planned)
        check_no_bottle(scenario)
        self._allowed = (-1.0, 1.0, VENT) if batch.program.walks else (-1.0, 1.0)
        self._run = SampledRun(batch)
        self.period = scenario.controller.period
        self.measurement: Measurement | GaitMeasurement = self._run.measurement()

    @property
    def time(self) -> float:
        """Time of the present sample [s]."""
        return self._run.time

    @property
    def reference(self) -> float:
        """Reference at the present sample: torque [N m], angle [rad] or pressure [Pa], as ``reference.of`` says.

        In a walk it is the torque that its controller would request, 0 if that requests none.
        """
        return self._run.reference

    @property
    def state(self) -> Any:
        """True state: ``angle`` [rad], ``angular_velocity`` [rad/s], ``mass_1``, ``supplied_mass`` [kg] and others."""
        return self._run.state

    @property
    def has_diverged(self) -> bool:
        """True if the numerical solution has failed, as ``Result.status`` tells."""
        return self._run.has_diverged

    @property
    def is_over(self) -> bool:
        """True at the end of the scenario, and for a run that has diverged."""
        return self._run.sample >= self._run.samples or self.has_diverged

    def step(self, command: float) -> Measurement | GaitMeasurement:
        """Apply a command [-] until the next sample, and return the measurement there.

        A command is -1 to 1, or ``VENT`` (2) in a walk, which vents both chambers. Raises SimulationError for any
        other, and for a run that is over.
        """
        if self.is_over:
            raise SimulationError(f"{self._scenario.name}: the run is over at t = {self.time:.6g} s; start another one")
        try:
            given = _NUMBER.take("command", command)
        except ArgumentError:
            given = float("nan")  # no number is refused as this one is
        lowest, highest, *vent = self._allowed
        if not (lowest <= given <= highest or given in vent):
            also = f", or {VENT:g} to vent both chambers" if vent else ""
            raise SimulationError(f"command = {shown(command)} at t = {self.time:.6g} s: must be -1 to 1{also}")
        self._given.commands[self._run.sample :] = [given]
        self._run.advance(given)
        self.measurement = self._run.measurement()
        return self.measurement

    def result(self) -> Result:
        """Return the result up to the present sample; its scenario repeats the given commands in ``simulate``.

        Raises SimulationError before the first step.
        """
        if not self._run.sample:
            raise SimulationError(f"{self._scenario.name}: no command has been given yet, so there is nothing recorded")
        return result_of(self._scenario, self._planned, self._run.result())


@checked
def start(scenario: Scenario | str | Path, overrides: Overrides = (), *, plugins: Plugins = ()) -> SteppedRun:
    """Start a run whose valve commands the caller gives, one for each sample of the controller.

    It has the sensors, sample period and duration of the scenario, without its controller. Start another run to begin
    again, with another ``sensors.seed`` for other noise.

    Arguments:
        scenario: a Scenario, the name of a shipped one, or a .toml file
        overrides: values to change, as in ``simulate``
        plugins: modules of your own, files or names, whose objects files may name

    Returns:
        a SteppedRun at time 0

    Raises:
        ScenarioError: a scenario that cannot be used
        ParameterError: a parameter set, or a value of it, that cannot be used

    >>> import ppafo
    >>> run = ppafo.start("torque-task-proportional", {"run.duration": "0.1 s"})
    >>> while not run.is_over:
    ...     measurement = run.step(max(-1.0, min(1.0, 0.3 * (run.reference - run.measurement.torque))))
    >>> print(f"{run.time:.1f} s, {measurement.torque:.2f} N m, {run.state.supplied_mass:.1e} kg of gas")
    0.1 s, 0.35 N m, 2.2e-05 kg of gas
    """
    return SteppedRun(scenario_or_load(scenario, overrides))
