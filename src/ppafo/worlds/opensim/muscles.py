"""What the muscles of an ankle have to give along a measured motion, with and without a device: static optimisation.

OpenSim's own tools do both: InverseDynamicsTool the moment, AnalyzeTool with StaticOptimization the muscles, which
share the moments of all joints so that the sum of squared activations is least.
"""

import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import opensim
from numpy.typing import NDArray

from ppafo.answers.style import BLACK, BLUE, GREY, VERMILION, house_style, label_lines, mark_kind
from ppafo.errors import DataError, SimulationError, nearest_name, one_line
from ppafo.exports.opensim.add_device import SUFFIX, add_load
from ppafo.signals import Recording
from ppafo.worlds.opensim.device import CONTACT, check_place, coordinate_names, load_model, muscles_across, read_motion

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Floats = NDArray[np.float64]

RESERVE, RESIDUAL = 1.0, 100.0
"""Torque or force [N m or N] that a reserve gives at a control of 1: a joint's, and one of what no muscle moves."""
_UNBOUNDED = 1.0e5
_NAME = "ankle"
_WITHOUT, _WITH = "without", "with"
_MUSCLES_SHOWN = 6
_NO_FILTER = -1.0


@dataclass(frozen=True, slots=True, eq=False)
class AnkleMuscles:
    """Moments and forces along a motion, each by ``with`` and ``without`` the device, at ``time`` [s].

    ``moment`` [N m] is what inverse dynamics leaves of the ankle for the muscles, and ``device`` [N m] what the device
    adds, all above 0 in dorsiflexion. ``forces`` [N] are those of the muscles that cross the ankle, by name,
    ``activations`` [-] the same. ``reserve`` [N m] is what muscles could not give.
    """

    model: str
    coordinate: str
    time: Floats
    device: Floats
    moment: Mapping[str, Floats]
    forces: Mapping[str, Mapping[str, Floats]]
    activations: Mapping[str, Mapping[str, Floats]]
    reserve: Mapping[str, Floats]

    def change(self, muscle: str) -> float:
        """By how much the device changes the mean force of a muscle, as a fraction of that without it."""
        before, after = (float(self.forces[way][muscle].mean()) for way in (_WITHOUT, _WITH))
        return after / before - 1.0

    def __repr__(self) -> str:
        """Return one line a muscle: mean and largest force without and with the device."""
        head = f"{self.coordinate} of {self.model}, {self.time[0]:.4g} to {self.time[-1]:.4g} s, force in N"
        lines = [head, f"{'muscle':<24}{'mean':>8}{'with':>8}{'change':>8}{'peak':>9}{'with':>8}"]
        for name, force in self.forces[_WITHOUT].items():
            helped = self.forces[_WITH][name]
            lines.append(
                f"{name:<24}{force.mean():>8.0f}{helped.mean():>8.0f}{100.0 * self.change(name):>+7.1f}%"
                f"{force.max():>9.0f}{helped.max():>8.0f}"
            )
        most = max(float(np.abs(values).max()) for values in self.reserve.values())
        return "\n".join([*lines, f"largest torque that the muscles left to the reserve: {most:.2g} N m"])

    def plot(self) -> "Figure":
        """Return a figure of moments and muscles; ``.savefig(...)`` writes it."""
        # The figure: the moment above, the muscles that give most force below it.
        from matplotlib.figure import Figure

        before, after = self.forces[_WITHOUT], self.forces[_WITH]
        names = sorted(before, key=lambda name: -before[name].max())[:_MUSCLES_SHOWN]
        with house_style():
            figure = Figure(figsize=(8.4, 2.0 + 1.7 * len(names)))
            top, *panels = figure.subplots(1 + len(names), 1, sharex=True)
            top.plot(self.time, self.moment[_WITHOUT], color=GREY, label="without the device")
            top.plot(self.time, self.moment[_WITH], color=BLUE, label="with it")
            top.plot(self.time, self.device, color=VERMILION, label="the device")
            top.axhline(0.0, color=BLACK, linewidth=0.6)
            top.set_ylabel("ankle moment (N m)\ndorsiflexion above 0")
            label_lines(top)
            for axes, name in zip(panels, names, strict=True):
                axes.plot(self.time, before[name], color=GREY)
                axes.plot(self.time, after[name], color=BLUE)
                axes.set_ylim(bottom=0.0)
                axes.set_ylabel(f"{name} (N)")
            panels[-1].set_xlabel("time (s)")
            figure.suptitle(f"{self.coordinate} of {self.model}, static optimisation", x=0.02, ha="left", fontsize=10)
            mark_kind(figure, "simulated")
            figure.tight_layout()
            return figure


def ankle_muscles(
    model: str | Path,
    motion: str | Path,
    loads: str | Path,
    torque: Recording,
    low_pass: float | None = 6.0,
    every: int = 1,
    coordinate: str | None = None,
) -> AnkleMuscles:
    """Return moments and muscle forces with and without the torque of a device, over the times of ``torque``.

    ``model`` (.osim), ``motion`` (.mot or .sto) and ``loads`` (external loads, .xml) are files of OpenSim; ``torque``
    is that of ``exports.opensim.device_torque``, for the ``coordinate`` that its channel names, or another one. The
    motion goes through a low pass [Hz] unless that is None, and every so many-th row of it is solved. It is the same
    with and without, so the device must be one that does not change it. Contact forces of the model are left out, since
    the loads stand for them, and every coordinate gets a reserve. DataError for files that do not fit each other;
    SimulationError where OpenSim fails.
    """
    (channel,) = torque.names
    coordinate = coordinate or channel.removesuffix(SUFFIX)
    if (low_pass is not None and not low_pass > 0.0) or every < 1:
        raise DataError(f"low_pass = {low_pass}, every = {every}: must be above 0 Hz or None, and 1 or more")
    start, end = float(torque.time[0]), float(torque.time[-1])
    if not Path(loads).is_file():
        raise DataError(f"{loads}: there is no such file; give external loads of OpenSim (.xml)")
    task = _Task(Path(motion).resolve(), Path(loads).resolve(), low_pass, every, start, end)
    bare = load_model(model)
    _check_fit(bare, task, coordinate, motion)
    names = muscles_across(bare, coordinate)
    found: dict[str, _Solved] = {}
    for way in (_WITHOUT, _WITH):
        prepared = load_model(model)
        # Without what presses the feet on the ground.
        forces = prepared.updForceSet()
        for index in reversed(range(forces.getSize())):
            if forces.get(index).getConcreteClassName() in CONTACT:
                forces.remove(index)
        if way == _WITH:
            add_load(prepared, coordinate, torque.time.tolist(), torque[channel].tolist())
        with tempfile.TemporaryDirectory() as folder:
            found[way] = _solve(prepared, task, coordinate, names, Path(folder))
    time = found[_WITHOUT].time
    return AnkleMuscles(
        model=bare.getName(),
        coordinate=coordinate,
        time=time,
        device=np.interp(time, torque.time, torque[channel]),
        moment={way: item.moment for way, item in found.items()},
        forces={way: item.forces for way, item in found.items()},
        activations={way: item.activations for way, item in found.items()},
        reserve={way: item.reserve for way, item in found.items()},
    )


@dataclass(frozen=True, slots=True)
class _Task:
    """What is the same with and without the device."""

    motion: Path
    loads: Path
    low_pass: float | None
    every: int
    start: float
    end: float


@dataclass(frozen=True, slots=True)
class _Solved:
    time: Floats
    moment: Floats
    forces: Mapping[str, Floats]
    activations: Mapping[str, Floats]
    reserve: Floats


def _check_fit(model: Any, task: "_Task", coordinate: str, motion: str | Path) -> None:
    """Refuse a motion and loads that do not fit the model, and a motion that does not last as long as the torque."""
    check_place(model, coordinate)
    # Refuse loads without their table, and those on bodies that the model does not have.
    path = task.loads
    try:
        loads = opensim.ExternalLoads(str(path), True)
    except RuntimeError as error:
        raise DataError(f"{path}: OpenSim cannot read it as external loads: {one_line(error)}") from error
    if loads.getSize() == 0:
        raise DataError(f"{path}: has no external force")
    table = path.parent / loads.getDataFileName()
    if not table.is_file():
        raise DataError(f"{path}: there is no data file {table}")
    bodies = [model.getBodySet().get(index).getName() for index in range(model.getBodySet().getSize())]
    for index in range(loads.getSize()):
        body = loads.get(index).get_applied_to_body()
        if body not in bodies:
            raise DataError(
                f"{path}: model {model.getName()} has no body '{body}'{nearest_name(body, bodies)}; "
                f"there are: {', '.join(bodies)}"
            )
    time = read_motion(motion, model, coordinate).time
    if not time[0] <= task.start < task.end <= time[-1]:
        raise DataError(
            f"{motion}: goes from {time[0]:g} to {time[-1]:g} s, and the torque from {task.start:g} to "
            f"{task.end:g} s; lay the torque on heel strikes of the motion"
        )


def _solve(model: Any, task: _Task, coordinate: str, names: tuple[str, ...], folder: Path) -> _Solved:
    """Run both tools in a folder of their own."""
    plain, reserved = folder / "plain.osim", folder / "reserved.osim"
    model.finalizeConnections()
    model.printToXML(str(plain))
    # Give every coordinate an actuator that costs much: OpenSim needs one where muscles cannot give a moment.
    for name in coordinate_names(model):
        reserve = opensim.CoordinateActuator(name)
        reserve.setName(f"{name}_reserve")
        joint = model.getCoordinateSet().get(name).getJoint()
        on_ground = joint.getParentFrame().findBaseFrame().getName() == model.getGround().getName()
        reserve.setOptimalForce(RESIDUAL if on_ground else RESERVE)
        reserve.setMinControl(-_UNBOUNDED)
        reserve.setMaxControl(_UNBOUNDED)
        model.addForce(reserve)
    model.finalizeConnections()
    model.printToXML(str(reserved))
    try:
        tool = opensim.InverseDynamicsTool()
        tool.setModelFileName(str(plain))
        tool.setCoordinatesFileName(str(task.motion))
        tool.setLowpassCutoffFrequency(_NO_FILTER if task.low_pass is None else task.low_pass)
        tool.setExternalLoadsFileName(str(task.loads))
        tool.setStartTime(task.start)
        tool.setEndTime(task.end)
        tool.setResultsDir(str(folder))
        tool.setOutputGenForceFileName("moments.sto")
        left_out = opensim.ArrayStr()
        left_out.append("Muscles")
        tool.setExcludedForces(left_out)
        good = bool(tool.run()) and _static_optimisation(reserved, task, folder)
    except RuntimeError as error:
        raise SimulationError(f"{model.getName()}: OpenSim stopped: {one_line(error)}") from error
    if not good:
        raise SimulationError(f"{model.getName()}: OpenSim did not come to an end; run its tools to see why")
    forces = opensim.TimeSeriesTable(str(folder / f"{_NAME}_StaticOptimization_force.sto"))
    activations = opensim.TimeSeriesTable(str(folder / f"{_NAME}_StaticOptimization_activation.sto"))
    moments = opensim.TimeSeriesTable(str(folder / "moments.sto"))
    time = np.array(forces.getIndependentColumn())
    return _Solved(
        time=time,
        moment=np.interp(time, moments.getIndependentColumn(), _column(moments, f"{coordinate}_moment")),
        forces={name: _column(forces, name) for name in names},
        activations={name: _column(activations, name) for name in names},
        reserve=_column(forces, f"{coordinate}_reserve"),
    )


def _column(table: Any, name: str) -> Floats:
    """Return a column of a table that OpenSim wrote: it has some columns twice, which our reader refuses."""
    values: Floats = np.array(table.getDependentColumn(name).to_numpy())
    return values


def _static_optimisation(model: Path, task: _Task, folder: Path) -> bool:
    """Run the tool from a file of its settings: only so does it take its analyses."""
    sharing = opensim.StaticOptimization()
    sharing.setStartTime(task.start)
    sharing.setEndTime(task.end)
    sharing.setStepInterval(task.every)
    sharing.setUseModelForceSet(True)
    sharing.setActivationExponent(2.0)
    sharing.setUseMusclePhysiology(True)
    tool = opensim.AnalyzeTool()
    tool.setName(_NAME)
    tool.setModelFilename(str(model))
    tool.setCoordinatesFileName(str(task.motion))
    tool.setLowpassCutoffFrequency(_NO_FILTER if task.low_pass is None else task.low_pass)
    tool.setExternalLoadsFileName(str(task.loads))
    tool.setInitialTime(task.start)
    tool.setFinalTime(task.end)
    tool.setResultsDir(str(folder))
    tool.setSolveForEquilibrium(False)
    tool.updAnalysisSet().cloneAndAppend(sharing)
    setup = folder / "setup.xml"
    tool.printToXML(str(setup))
    return bool(opensim.AnalyzeTool(str(setup)).run())
