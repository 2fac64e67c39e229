"""What the tests of OpenSim do in a process of their own: in that of other tests CasADi may be loaded, or is to be."""

import math
import sys
from pathlib import Path
from typing import Any

import numpy as np

import ppafo
from ppafo.exports.opensim import device_torque
from ppafo.exports.opensim.add_device import add_actuator, line
from ppafo.signals import Channel, Recording
from ppafo.simulation.loading import load_scenario
from ppafo.storage.opensim import write_opensim
from ppafo.walking.loading import load_walk
from ppafo.walking.walk import walk

SECONDS = 3.0
FRICTIONLESS = ["friction.static_torque=0 N m", "friction.dynamic_torque=0 N m"]
START = [*FRICTIONLESS, "initial.pressure_1=atmosphere", "initial.pressure_2=atmosphere", "motion.angle=70 deg"]
FREE = [
    "motion.kind=free",
    *START,
    "foot_plate.gravity_torque=0.3 N m",
    "controller.command=0.15",
    "run.duration=0.2 s",
]
PULL = 3.0
TORQUE = "torque\nendheader\ntime\tankle_angle_r_device\n0\t1\n1\t2\n"
FORCE, LEVER = 600.0, 0.1


def leg(is_led: bool = True) -> Any:
    """A shank that turns about the knee, or stands upright, and a foot without mass on a hinge."""
    import opensim

    model = opensim.Model()
    model.setName("leg")
    model.setGravity(opensim.Vec3(0, -9.80665, 0))
    above = model.getGround()
    if is_led:
        above = opensim.Body("tibia_r", 3.0, opensim.Vec3(0, -0.2, 0), opensim.Inertia(0.05))
        model.addBody(above)
        knee = opensim.PinJoint("knee", model.getGround(), above)
        knee.updCoordinate().setName("shank_angle")
        model.addJoint(knee)
    foot = opensim.Body("foot_r", 1.0e-3, opensim.Vec3(0), opensim.Inertia(1.0e-9))
    model.addBody(foot)
    place, level = opensim.Vec3(0, -0.43 if is_led else 0.0, 0), opensim.Vec3(0)
    ankle = opensim.PinJoint("ankle_r", above, place, level, foot, level, level)
    ankle.updCoordinate().setName("ankle_angle_r")
    model.addJoint(ankle)
    model.finalizeConnections()
    return model


def write_leg_with_muscles(path: Path) -> None:
    """The leg with a muscle in front and one behind."""
    import opensim

    model = leg()
    bodies = model.getBodySet()
    for name, side, strength in (("soleus_r", -1.0, 5000.0), ("tib_ant_r", 1.0, 2000.0)):
        muscle = opensim.Thelen2003Muscle(name, strength, 0.05, 0.3, 0.0)
        muscle.addNewPathPoint("origin", bodies.get("tibia_r"), opensim.Vec3(side * 0.03, -0.1, 0))
        muscle.addNewPathPoint("insertion", bodies.get("foot_r"), opensim.Vec3(side * 0.045, -0.03, 0))
        model.addForce(muscle)
    model.finalizeConnections()
    model.printToXML(str(path))


def replay(name: str, folder: Path) -> dict[str, Any]:
    """A shipped walk whose ankle OpenSim leads: torque of the gas, and T_ex by OpenSim's own inverse dynamics."""
    import opensim

    from ppafo.worlds.opensim import CoSimulation, DeviceAtAnkle, follow_motion
    from ppafo.worlds.opensim.device import add_foot_plate

    chosen = load_walk(name, ["wearer.keeps_gait=1"])
    recording = walk(chosen, 0.1).recording
    recording = recording.between(0.0, SECONDS)
    motion = {"ankle_angle_r": 0.5 * math.pi - recording["angle"], "shank_angle": recording["shank_angle"]}
    channels = {column: Channel(values, "rad") for column, values in motion.items()}
    write_opensim(folder / "motion.sto", Recording("motion", recording.time, channels))
    model, device = leg(), DeviceAtAnkle(chosen, 1.0e-3, SECONDS)
    follow_motion(model, folder / "motion.sto", "ankle_angle_r")
    together = CoSimulation(model, "ankle_angle_r", device)
    samples, gas, acts = [together.begin()], [device.actuator_torque()], [0.0]
    for command in recording["command"][: device.steps]:
        samples.append(together.go_on(float(command)))
        gas.append(device.actuator_torque())
        acts.append(together.actuation())
    judged = leg()
    add_foot_plate(judged, "ankle_angle_r", device)
    torques = [sample.torque for sample in samples]
    add_actuator(judged, "ankle_angle_r", line([sample.time for sample in samples], torques))
    judged.printToXML(str(folder / "judged.osim"))
    tool = opensim.InverseDynamicsTool()
    tool.setModelFileName(str(folder / "judged.osim"))
    tool.setCoordinatesFileName(str(folder / "motion.sto"))
    tool.setEndTime(SECONDS)
    tool.setResultsDir(str(folder))
    tool.setOutputGenForceFileName("moments.sto")
    assert tool.run()
    table = opensim.TimeSeriesTable(str(folder / "moments.sto"))
    moment = np.interp(
        recording.time, table.getIndependentColumn(), table.getDependentColumn("ankle_angle_r_moment").to_numpy()
    )
    return {
        "gas": np.array(gas),
        "torque": recording["torque"],
        "acts": np.array(acts),
        "samples": np.array(torques),
        "moment": moment,
        "external": recording["external_torque"],
        "supplied": (device.supplied_mass(), float(recording["supplied_mass"][-1])),
    }


def swing(period: float) -> tuple[np.ndarray, np.ndarray]:
    """Angles [rad] of a free foot whose mass is OpenSim's, and of the same in `ppafo simulate`."""
    import opensim

    from ppafo.worlds.opensim import CoSimulation, DeviceAtAnkle

    scenario = load_scenario("step-response", [*FREE, f"motion.external_torque={PULL} N m"])
    alone = ppafo.simulate(scenario).recording
    model = leg(is_led=False)
    pull = opensim.CoordinateActuator("ankle_angle_r")
    pull.setName("pull")
    pull.setOptimalForce(1.0)
    model.addForce(pull)
    controller = opensim.PrescribedController()
    controller.addActuator(pull)
    controller.prescribeControlForActuator("pull", opensim.Constant(PULL))
    model.addController(controller)
    device = DeviceAtAnkle(scenario, period, 0.2)
    together = CoSimulation(model, "ankle_angle_r", device)
    together.model.getCoordinateSet().get("ankle_angle_r").setValue(together.state, math.radians(20.0))
    samples = [together.begin(), *(together.go_on(0.15) for _ in range(device.steps))]
    times = np.array([sample.time for sample in samples])
    return 0.5 * math.pi - np.array([sample.angle for sample in samples]), np.interp(times, alone.time, alone["angle"])


def beyond_the_stops() -> None:
    """A free foot that nothing stops."""
    from ppafo.worlds.opensim import CoSimulation, DeviceAtAnkle

    together = CoSimulation(leg(is_led=False), "ankle_angle_r", DeviceAtAnkle(load_walk("solenoid"), 1.0e-3, 1.0))
    for _ in range(1000):
        together.go_on(1.0)


def muscles(folder: Path) -> dict[str, Any]:
    """Muscles of a leg that stands on its toes and rocks, with a device of 3 N m and without one."""
    from ppafo.worlds.opensim import ankle_muscles, load_model

    write_leg_with_muscles(folder / "leg.osim")
    time = np.linspace(0.0, 0.5, 51)
    motion = {"ankle_angle_r": 0.1 * np.sin(6.0 * time), "shank_angle": 0.05 * np.cos(6.0 * time)}
    write_opensim(folder / "motion.sto", Recording("m", time, {n: Channel(v, "rad") for n, v in motion.items()}))
    forces = {f"force_{kind}{axis}": np.zeros(51) for kind in "vpt" for axis in "xyz"}
    forces |= {"force_vy": np.full(51, FORCE), "force_px": np.full(51, LEVER), "force_py": np.full(51, -0.48)}
    write_opensim(folder / "force.sto", Recording("f", time, {n: Channel(v, "N") for n, v in forces.items()}))
    write_loads(folder)
    torque = Recording("d", np.array([0.1, 0.4]), {"ankle_angle_r_device": Channel(np.full(2, -3.0), "N m")})
    found = ankle_muscles(folder / "leg.osim", folder / "motion.sto", folder / "loads.xml", torque, low_pass=None)
    model = load_model(folder / "leg.osim")
    state, coordinate = model.initSystem(), model.getCoordinateSet().get("ankle_angle_r")
    arms = []
    for moment in found.time:
        coordinate.setValue(state, 0.1 * math.sin(6.0 * moment))
        paths = {name: model.getMuscles().get(name).getGeometryPath() for name in found.forces["with"]}
        arms.append({name: path.computeMomentArm(state, coordinate) for name, path in paths.items()})
    found.plot().savefig(folder / "figure.png")
    return {
        "time": found.time,
        "moment": dict(found.moment),
        "device": found.device,
        "forces": {way: dict(each) for way, each in found.forces.items()},
        "reserve": dict(found.reserve),
        "arms": {name: np.array([row[name] for row in arms]) for name in arms[0]},
        "said": repr(found),
    }


def write_loads(folder: Path) -> None:
    """A force on the foot, as OpenSim takes it."""
    import opensim

    loads = opensim.ExternalLoads()
    loads.setDataFileName("force.sto")
    force = opensim.ExternalForce()
    force.setName("ground")
    force.set_applied_to_body("foot_r")
    force.set_force_expressed_in_body("ground")
    force.set_point_expressed_in_body("ground")
    force.set_force_identifier("force_v")
    force.set_point_identifier("force_p")
    force.set_torque_identifier("force_t")
    loads.cloneAndAppend(force)
    loads.printToXML(str(folder / "loads.xml"))


def refused(what: str, folder: Path) -> None:
    """Files that do not fit."""
    from ppafo.worlds.opensim import ankle_muscles

    write_leg_with_muscles(folder / "leg.osim")
    write_loads(folder)
    (folder / "broken.osim").write_text("<OpenSimDocument", encoding="utf-8")
    (folder / "other.osim").write_text("<?xml version='1.0'?><a/>", encoding="utf-8")
    channels = {name: Channel(np.zeros(20), "rad") for name in ("ankle_angle_r", "shank_angle")}
    time = np.linspace(0.0, 0.5, 20)
    write_opensim(folder / "motion.sto", Recording("m", time, channels))
    if what != "loads-table":
        write_opensim(folder / "force.sto", Recording("f", time, channels))
    write_opensim(folder / "shank.sto", Recording("m", time, {"shank_angle": channels["shank_angle"]}))
    torque = Recording("d", np.array([0.1, 0.4]), {"ankle_angle_r_device": Channel(np.zeros(2), "N m")})
    late = Recording("d", np.array([0.1, 4.0]), {"ankle_angle_r_device": Channel(np.zeros(2), "N m")})
    files = {"model": folder / "leg.osim", "motion": folder / "motion.sto", "loads": folder / "loads.xml"}
    named = None
    if what in ("no-model", "broken-model", "other-model"):
        files["model"] = folder / {"no-model": "no.osim", "broken-model": "broken.osim"}.get(what, "other.osim")
    if what == "motion":
        files["motion"] = folder / "shank.sto"
    if what == "loads":
        files["loads"] = folder / "no.xml"
    if what == "loads-body":
        loads = files["loads"].read_text(encoding="utf-8")
        (folder / "body.xml").write_text(loads.replace("foot_r", "foot"), encoding="utf-8")
        files["loads"] = folder / "body.xml"
    if what == "coordinate":
        named = "ankle_angle"
    if what == "no-muscle":
        named = "shank_angle"
    ankle_muscles(*files.values(), late if what == "late" else torque, coordinate=named)


def with_script(folder: Path) -> np.ndarray:
    """Torque that a model with the exported device gives in forward dynamics, and the exported one [N m]."""
    import opensim

    from ppafo.exports.opensim import opensim_files
    from ppafo.exports.opensim.add_device import main

    result = walk("solenoid", 0.1)
    strikes = (0.1, 1.2)
    for name, content in opensim_files(result, "right", strikes).items():
        (folder / name).write_bytes(content)
    leg().printToXML(str(folder / "leg.osim"))
    words = [str(folder / "leg.osim"), "--torque", str(folder / "device_torque.sto"), "--out"]
    assert main([*words, str(folder / "driven.osim")]) == 0
    assert main([*words, str(folder / "loaded.osim"), "--as-load"]) == 0
    rows = []
    torque = device_torque(result, "right", strikes)
    driven, loaded = (opensim.Model(str(folder / f"{name}.osim")) for name in ("driven", "loaded"))
    states = [model.initSystem() for model in (driven, loaded)]
    actuator = opensim.CoordinateActuator.safeDownCast(driven.getForceSet().get("ankle_angle_r_device"))
    for moment in (0.1, 0.3, 0.665, 1.0, 1.2):
        for state in states:
            state.setTime(moment)
        driven.realizeDynamics(states[0])
        loaded.realizeAcceleration(states[1])
        driven.realizeAcceleration(states[0])
        turning = [model.getCoordinateSet().get("ankle_angle_r") for model in (driven, loaded)]
        rates = [each.getAccelerationValue(state) for each, state in zip(turning, states, strict=True)]
        expected = np.interp(moment, torque.time, torque["ankle_angle_r_device"])
        rows.append((actuator.getActuation(states[0]), expected, *rates))
    return np.array(rows)


def script_twice(folder: Path, first: list[str], second: list[str]) -> list[int]:
    """Exit codes of the exported script on a model and on what it wrote."""
    from ppafo.exports.opensim.add_device import main

    (folder / "torque.sto").write_text(TORQUE, encoding="utf-8")
    slide_and_foot().printToXML(str(folder / "leg.osim"))
    torque = ["--torque", str(folder / "torque.sto"), "--out"]
    return [
        main([str(folder / "leg.osim"), *torque, str(folder / "one.osim"), *first]),
        main([str(folder / "one.osim"), *torque, str(folder / "two.osim"), *second]),
    ]


def slide_and_foot() -> Any:
    """The leg, and a body beside it that slides along ``slide``."""
    import opensim

    model = leg()
    sledge = opensim.Body("sledge", 1.0, opensim.Vec3(0), opensim.Inertia(1.0))
    model.addBody(sledge)
    rail = opensim.SliderJoint("rail", model.getGround(), sledge)
    rail.updCoordinate().setName("slide")
    model.addJoint(rail)
    model.finalizeConnections()
    return model


def two_devices(first: str, second: str) -> None:
    """One co-simulation after the other on one model."""
    from ppafo.worlds.opensim import CoSimulation, DeviceAtAnkle

    model, device = slide_and_foot(), DeviceAtAnkle(load_walk("solenoid"), 1.0e-3, 1.0)
    for coordinate in (first, second):
        CoSimulation(model, coordinate, device)


def command_after_a_step(command: float) -> float:
    """How far [s] OpenSim went under a command that is refused, or the time after one that is not."""
    from ppafo.worlds.opensim import CoSimulation, DeviceAtAnkle

    together = CoSimulation(leg(is_led=False), "ankle_angle_r", DeviceAtAnkle(load_walk("solenoid"), 1.0e-3, 1.0))
    before = together.go_on(0.0).time
    try:
        return together.go_on(command).time - before
    except ppafo.errors.DataError as error:
        assert "must be -1 to 1, or 2 to vent" in str(error)
        return float(together.state.getTime()) - before


def device_of(scenario: Path) -> None:
    """The device of a scenario at an ankle."""
    from ppafo.worlds.opensim import DeviceAtAnkle

    DeviceAtAnkle(load_scenario(scenario))


def warm_at_rest(angle: float) -> list[tuple[float, float]]:
    """Absolute pressures [Pa] of shut chambers, whose gas has an energy balance, at an angle [rad] for 50 ms."""
    from ppafo.worlds.opensim import DeviceAtAnkle

    words = ("kind=thermal", "heat_transfer_coefficient=50 W/(m^2 K)", "wall_area_per_volume=100 1/m")
    given = [*(f"gas_model.{word}" for word in words), "actuator.leak.area=0 mm^2"]
    device = DeviceAtAnkle(load_scenario("torque-task-proportional", given), 1.0e-3, 1.0)
    device.begin(angle)
    found = [device.pressures()]
    for _ in range(50):
        device.go_on(0.0, angle, angle)
        found.append(device.pressures())
    return found


def failed() -> None:
    """A device whose run has failed with numbers that are finite."""
    from ppafo.worlds.opensim import DeviceAtAnkle

    device = DeviceAtAnkle(load_walk("solenoid"), 1.0e-3, 1.0)
    device._block.states[device._failure] = 0.0
    device.go_on(1.0, 1.5, 1.5)


def heavy_plate() -> tuple[float, float]:
    """Inertia [kg m^2] and moment of the weight [N m] about the ankle, of a plate with a long lever, in the model."""
    import opensim

    from ppafo.worlds.opensim import DeviceAtAnkle
    from ppafo.worlds.opensim.device import add_foot_plate

    device = DeviceAtAnkle(load_walk("solenoid"), 1.0e-3, 1.0)
    device.plant = device.plant._replace(inertia=0.0084, gravity_torque=1.0)
    model = leg()
    add_foot_plate(model, "ankle_angle_r", device)
    plate = model.getBodySet().get("ankle_angle_r_foot_plate")
    mass, lever = plate.getMass(), plate.getMassCenter().get(0)
    about_centre = opensim.Body.safeDownCast(plate).getInertia().getMoments().get(2)
    return about_centre + mass * lever * lever, mass * lever * 9.80665


def begun_at(angle: float) -> None:
    """A device at an angle [rad] of the package."""
    from ppafo.worlds.opensim import DeviceAtAnkle

    DeviceAtAnkle(load_walk("solenoid"), 1.0e-3, 1.0).begin(angle)


def anew() -> tuple[Any, ...]:
    """Samples of one co-simulation from the same state twice; steps and gas at the second beginning, and gas later."""
    import opensim

    from ppafo.worlds.opensim import CoSimulation, DeviceAtAnkle

    device = DeviceAtAnkle(load_walk("solenoid"), 1.0e-3, 0.02)
    together = CoSimulation(leg(is_led=False), "ankle_angle_r", device)
    start, found = opensim.State(together.state), []
    for _ in range(2):
        together.state = start
        first, begun = together.begin(), (device.taken, device.supplied_mass())
        samples = [first, *(together.go_on(1.0) for _ in range(device.steps))]
        # Plain tuples: a Sample would bring OpenSim into the process of the other tests.
        found.append([tuple(sample) for sample in samples])
    used = device.supplied_mass()
    together.begin()
    assert together.go_on(0.5).time > found[1][-1][0]
    return *found, (*begun, used)


def meet(first: str, second: str) -> str:
    """What is said where CasADi and OpenSim would meet in one process, by the one that comes second."""
    loaders = {"casadi": _load_casadi, "opensim": _load_opensim}
    loaders[first]()
    try:
        loaders[second]()
    except (ImportError, ppafo.errors.PpafoError) as error:
        return f"{type(error).__name__}: {error}"
    return "nothing"


def _load_casadi() -> None:
    from ppafo.questions.linearise.solve import linearise

    linearise("torque-task-proportional", 1.0)
    assert "casadi" in sys.modules


def _load_opensim() -> None:
    import ppafo.worlds.opensim  # noqa: F401


def table_as_read(path: Path) -> dict[str, Any]:
    """What OpenSim reads in a table: time, columns, two words of its head, and the lines its older reader finds."""
    import opensim

    opensim.Logger.removeFileSink()
    table = opensim.TimeSeriesTable(str(path))
    labels = list(table.getColumnLabels())
    return {
        "time": list(table.getIndependentColumn()),
        "columns": {name: table.getDependentColumn(name).to_numpy().tolist() for name in labels},
        "said": {name: table.getTableMetaDataAsString(name) for name in ("inDegrees", "kind")},
        "storage size": opensim.Storage(str(path)).getSize(),
    }


def write_again(source: Path, target: Path) -> None:
    """Let OpenSim write a table that it has read."""
    import opensim

    opensim.Logger.removeFileSink()
    opensim.STOFileAdapter.write(opensim.TimeSeriesTable(str(source)), str(target))
