"""Program: combination of the components (valve, controller, gas, ...) of one compiled model."""

from dataclasses import dataclass
from functools import lru_cache
from types import ModuleType

from ppafo.control.kind import DEAD_BAND, OPEN_LOOP, ControllerKind, ProfileKind
from ppafo.control.profiles import CONSTANT
from ppafo.engine.channels import REQUEST, TRACED, TRACED_IN_WALKS
from ppafo.engine.groups import Groups, Role, given, handed, kept, merged, rows_of
from ppafo.engine.rows import leaf_paths
from ppafo.engine.scheme.actuators import functions_of_actuator
from ppafo.engine.scheme.motion import FreePart, PartEnd, PartSlide, PrescribedStep, StepControl
from ppafo.engine.scheme.pneumatics import Flows, GasFlows, GasStage, HeldChambers, SlopedFlows
from ppafo.engine.scheme.thermal_gas import ThermalFlows, ThermalStage
from ppafo.engine.step.lane import LaneResult, LaneTiming
from ppafo.kinds import kind_at
from ppafo.model.actuators.kind import ActuatorModel
from ppafo.model.actuators.vane import MODEL as VANE
from ppafo.model.controlled import CONTROLLED, TORQUE
from ppafo.model.declaration import EmptyRow, PlainFunction
from ppafo.model.effects.kind import Effect, State
from ppafo.model.plant import ActuatorFunctions, PlantState, ThermalParameters, ThermalState
from ppafo.model.ports import exhaust_path, leakage_path, supply_path
from ppafo.model.sensors import SensorParameters
from ppafo.model.valves.kind import ValveModel
from ppafo.signals.meter import LED_SHANK, REQUESTED, WALK, MeterKind, ReferenceSummary
from ppafo.wording import place


@dataclass(frozen=True, slots=True)
class Program:
    """Combination of components; each combination is compiled once.

    Attributes:
        valve, reference, controller: valve, reference profile and controller; without a controller (None), the caller
            sets the command at each sample
        angle: profile that prescribes the angle; None for an unconstrained vane or a walk
        ideal_sensors: False for signals with noise and quantisation
        late_commands: True for a dead time before the valve
        is_thermal: True if the gas has an energy balance
        late_signals: True for delayed signals
        leg: module ``walk`` for a walking leg, whose foot is free or moved by ground and gait, with sensors
        feed: module ``lines`` for supply lines; None for constant supply pressures
        is_adaptive: True for steps divided by error control
        rests_whole: True if steps with a prescribed joint at rest are undivided under the conditions for a locked joint
        samples_inside: True if recorded samples lie inside steps
        meters: meters, updated at every sample that a recording would have
        traced: names of channels, or paths of state variables, stored at some of the samples
        actuator: actuator between the chambers and the joint
        effects: effects, applied in this order at the ports of their laws
        shank, foot: profile of the shank, and module ``foot``, for a foot carried by an unconstrained vane
        controlled: name of the quantity that follows the reference
        has_one_chamber: True if chamber 2 is only the dead volume downstream of a port and is not measured
    """

    valve: ValveModel
    reference: ProfileKind
    controller: ControllerKind | None
    angle: ProfileKind | None
    ideal_sensors: bool
    late_commands: bool
    is_thermal: bool = False
    late_signals: bool = False
    leg: ModuleType | None = None
    feed: ModuleType | None = None
    is_adaptive: bool = False
    rests_whole: bool = False
    samples_inside: bool = False
    meters: tuple[MeterKind, ...] = ()
    traced: tuple[str, ...] = ()
    actuator: ActuatorModel = VANE
    effects: tuple[Effect, ...] = ()
    shank: ProfileKind | None = None
    foot: ModuleType | None = None
    controlled: str = TORQUE
    has_one_chamber: bool = False

    @property
    def groups(self) -> Groups:
        """All groups of numbers of this program by name, in the order of their rows."""
        return groups_of(self)

    def parameter_rows(self) -> dict[str, type]:
        """Groups of parameter rows of this program, in order."""
        return rows_of(self.groups, Role.PARAMETER)

    def state_rows(self) -> dict[str, type]:
        """Groups of state rows of this program, in order."""
        return rows_of(self.groups, Role.STATE)

    @property
    def groups_of_plant(self) -> dict[str, PlainFunction]:
        """Functions of the plant that compute groups of parameters, by group name."""
        return {name: group.of_plant for name, group in self.groups.items() if group.of_plant is not None}

    def step_rows(self) -> dict[str, type]:
        """Groups of numbers that one phase of a step passes to later phases, in order."""
        return rows_of(self.groups, Role.STEP)

    @property
    def functions(self) -> ActuatorFunctions:
        """Functions of the actuator."""
        return functions_of_actuator(self.actuator)

    @property
    def inverts_valve(self) -> bool:
        """True if the law sends the command for the opening that it wants, where it also passes a dead band."""
        return "sent_command" in self.ports_with_laws and DEAD_BAND in getattr(self.controller, "quantities", ())

    @property
    def shank_jumps(self) -> bool:
        """True if the acceleration of the prescribed shank jumps at known times."""
        return self.shank is not None and self.shank.until_jump is not None

    @property
    def is_on_gait(self) -> bool:
        """True if a gait prescribes the shank, including the motion of the knee (``engine/step/foot.py``)."""
        return self.shank is not None and self.shank.name == "gait"

    @property
    def stated(self) -> dict[str, State]:
        """States of effects, by effect name."""
        return {effect.name: effect.state for effect in self.effects if effect.state is not None}

    @property
    def stated_with_errors(self) -> dict[str, State]:
        """States of effects with an error estimate for step control, by effect name."""
        return {name: kind for name, kind in self.stated.items() if kind.tolerances}

    @property
    def stated_at_ports(self) -> dict[str, State]:
        """States of effects used by laws that act on flows, by effect name."""
        ports = (supply_path, exhaust_path, leakage_path)
        laws = [(effect, effect.laws[port]) for effect in self.effects for port in ports if port in effect.laws]
        asked = {effect.name for effect, law in laws if effect.state_name in law.__code__.co_varnames}
        return {name: kind for name, kind in self.stated.items() if name in asked}

    @property
    def ports_with_laws(self) -> frozenset[str]:
        """Names of the ports at which effects act."""
        return frozenset(port.__name__ for effect in self.effects for port in effect.laws)

    @property
    def effect_states(self) -> dict[str, type]:
        """Groups of rows of the effect states, by name."""
        return {f"{name}_state": kind.row for name, kind in self.stated.items()}

    @property
    def walks(self) -> bool:
        """True if the device is on a walking leg."""
        return self.leg is not None

    @property
    def meter_groups(self) -> dict[str, MeterKind]:
        """Meters by the name of their group of state rows."""
        return {f"{kind.name}_meter": kind for kind in self.meters}

    @property
    def traces(self) -> dict[str, str]:
        """Path in a run of each traceable channel that is not a state variable of the same name."""
        if not self.walks:
            return TRACED
        paths = [path for name, row in self.state_rows().items() for path in leaf_paths(row, name)]
        found = {
            name: next((path for path in paths if path.endswith(ending)), "")
            for name, ending in TRACED_IN_WALKS.items()
        }
        return TRACED | {name: path for name, path in found.items() if path}

    @property
    def followed(self) -> str:
        """Quantity that follows the reference; empty without a reference, as in a walk."""
        return self.controlled if self.has_reference and not self.walks else ""

    @property
    def controlled_value(self) -> PlainFunction:
        """Function for the controlled quantity, of angle, both pressures and torque."""
        return CONTROLLED[self.controlled].value

    @property
    def wanted(self) -> str:
        """Quantity with a set-point, given by the reference or by a walking controller that requests a torque."""
        return TORQUE if self.walks and self.requests_torque else self.followed

    @property
    def offers(self) -> frozenset[str]:
        """Properties of the runs that a metric may require in addition to channels."""
        has = {
            WALK: self.walks,
            LED_SHANK: self.is_on_gait,
            REQUESTED: self.requests_torque,
        }
        return frozenset(need for need, is_there in has.items() if is_there)

    @property
    def chooses_parts(self) -> bool:
        """True if numeric values decide whether steps are divided: locked joint, rigid chambers, no supply lines."""
        return self.is_locked and self.feed is None and not (self.actuator.gives or self.valve.regulates)

    @property
    def takes_samples(self) -> bool:
        """True if meters or traces take samples instead of a recording."""
        return bool(self.meters or self.traced)

    @property
    def has_phase(self) -> bool:
        """True if the controller of a walk detects the gait phase."""
        return hasattr(getattr(getattr(self.controller, "initial", None), "phase", None), "phase")

    @property
    def requests_torque(self) -> bool:
        """True if the controller of a walk stores its requested torque."""
        return REQUEST in leaf_paths(self.state_rows()["controller_state"], "controller_state")

    @property
    def has_reference(self) -> bool:
        """True if the controller follows a reference; a constant command follows none."""
        return self.controller is None or self.controller.name != OPEN_LOOP

    @property
    def follows_reference(self) -> bool:
        """True if a meter needs the reference over the whole run."""
        return any(kind.needs_course for kind in self.meters)

    @property
    def cuts_reference(self) -> bool:
        """True if a meter needs the parts of a reference that has more than one."""
        return any(kind.end_part is not None for kind in self.meters) and not self.reference.is_wave

    @property
    def is_parted(self) -> bool:
        """True if a step may be divided into parts."""
        return self.is_adaptive or self.samples_inside or self.late_commands or self.late_signals or self.valve.jumps

    @property
    def parts_are_rare(self) -> bool:
        """True if a step is divided only when a valve switches inside it, so that runs rarely wait for others."""
        others = self.is_adaptive or self.samples_inside or self.late_commands or self.late_signals
        return self.valve.jumps and not others

    @property
    def is_locked(self) -> bool:
        """True if the angle is prescribed by a constant profile."""
        return self.angle is CONSTANT

    @property
    def keeps_volumes(self) -> bool:
        """True if the chamber volumes of a locked joint are computed only once."""
        return self.is_locked and not (self.is_thermal or self.feed is not None or self.actuator.gives)

    @property
    def hands_chambers_on(self) -> bool:
        """True if the chambers are known at the start of a step: constant, or from the previous step."""
        return self.keeps_volumes or self.walks


@lru_cache(maxsize=256)
def groups_of(program: Program) -> Groups:
    """Return all groups of numbers of a program by name, in the order of their rows."""
    leg = program.leg
    feed = program.feed
    shank = program.shank
    is_alone = program.angle is None and leg is None
    is_thermal = program.is_thermal
    controller = program.controller
    own = {
        "timing": given(LaneTiming),
        "result": kept(LaneResult),
        "pace": kept(StepControl),
        "plant": given(program.actuator.plant),
        "state": kept(PlantState),
        **({"held": handed(HeldChambers)} if program.hands_chambers_on else {}),
        **({"begun": handed(FreePart)} if is_alone else {}),
        **({"prescribed": handed(PrescribedStep)} if program.angle is not None and not program.is_locked else {}),
        "flowing": handed(SlopedFlows),
        **({"thermal": given(ThermalParameters), "masses": kept(ThermalState)} if is_thermal else {}),
        "gas_stage": handed(ThermalStage if is_thermal else GasStage),
        **({"change": handed(ThermalFlows if is_thermal else Flows)} if program.angle is None else {}),
        "passing": handed(GasFlows),
        "valve": given(program.valve.parameters),
        "valve_state": kept(program.valve.state),
        "shown": handed(program.valve.shown),
        **({"next_valve": handed(program.valve.state)} if program.is_parted else {}),
        "controller": given(EmptyRow if controller is None else controller.parameters),
        "controller_state": kept(EmptyRow if controller is None else type(controller.initial)),
        "reference": given(program.reference.parameters),
        "path": given(EmptyRow if program.angle is None else program.angle.parameters),
        "sensors": given(SensorParameters),
    }
    worn = [part.groups(program) for part in (leg, feed) if part is not None]
    # By its place, for few vanes carry a leg.
    foot = {"load": given(kind_at("ppafo.model.leg:FootLoad")), "shank": given(shank.parameters)} if shank else {}
    last = {
        **({"slid": handed(PartSlide), "moved": handed(PartEnd)} if is_alone else {}),
        **(dict.fromkeys(("length", "before", "remaining"), handed(float)) if program.is_parted else {}),
        **({"gas_error": handed(float)} if program.is_adaptive and program.angle is None else {}),
    }
    return {
        **merged(own, *worn, foot, last),
        # Linking refuses an effect with a name that is here already.
        **{effect.name: given(effect.parameters) for effect in program.effects},
        **{name: kept(row) for name, row in program.effect_states.items()},
        # Groups that only some blocks have come last: their rows are added to those of a run.
        "course": kept(ReferenceSummary if program.follows_reference else EmptyRow),
        **{group: kept(kind.state) for group, kind in program.meter_groups.items()},
    }


def place_of_group(program: Program, name: str) -> str:
    """Return file and line of the function that declares a group of a component; else the name of the group."""
    for part in (program.leg, program.feed):
        if part is not None and name in part.groups(program):
            code = part.groups.__code__
            return place(code.co_filename, code.co_firstlineno)
    return name
