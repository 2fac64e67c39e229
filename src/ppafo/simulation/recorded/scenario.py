"""The scenario of a recording that has none: a free or held vane from its start, the command left to the recording."""

from collections.abc import Collection
from dataclasses import replace

from ppafo.parameters.device import Device, Orifice
from ppafo.signals import Recording
from ppafo.simulation.recorded.inputs import DORSIFLEXION_SUPPLY, LONGEST_STEP, SUPPLY, sample_period
from ppafo.simulation.recorded.start import Start
from ppafo.simulation.scenario import (
    PYTHON_CONTROLLER,
    Control,
    FreeMotion,
    Origin,
    PrescribedMotion,
    ProfileChoice,
    Scenario,
    Sensors,
)

Motion = FreeMotion | PrescribedMotion


def held_vane(angle: float) -> PrescribedMotion:
    """Return the motion of a vane that is held at an angle [rad]: both chambers are fixed volumes."""
    return PrescribedMotion(ProfileChoice("constant", {"level": angle}))


def with_fixed_volume(device: Device, volume: float) -> Device:
    """Return the device with a fixed volume [m^3] in the place of chamber 1 and no vane: nothing leaks from it.

    It holds with the vane at the lower stop.
    """
    leak = device.actuator.leak
    shut = replace(leak, area=0.0) if isinstance(leak, Orifice) else replace(leak, sonic_conductance=0.0)
    return replace(device, actuator=replace(device.actuator, dead_volume_1=volume, leak=shut))


def replay_scenario(
    recording: Recording, device: Device, start: Start, duration: float, file: str, motion: Motion | None = None
) -> Scenario:
    """Return a run of ``duration`` [s] on the clock of a recording, whose command the caller sets step by step.

    The vane moves freely from where it starts unless another motion is given.
    """
    period = sample_period(recording.time)
    return Scenario(
        name=recording.label,
        description="replay of a recording",
        device=device,
        duration=duration,
        time_step=min(period, LONGEST_STEP),
        output_interval=period,
        motion=motion or FreeMotion(start.angle, start.angular_velocity),
        initial_pressure_1=start.pressure_1,
        initial_pressure_2=start.pressure_2,
        control=replay_control(recording),
        reference=ProfileChoice("constant", {"level": 0.0}),
        sensors=Sensors(),
        assumptions=(),
        origin=Origin(file, device.name, device.valve_name, (), {}),
    )


def replay_control(recording: Recording) -> Control:
    """Return the control of a run whose command comes from a recording: no controller, the period of the samples."""
    return Control(PYTHON_CONTROLLER, {}, sample_period(recording.time))


def with_highest_supply(device: Device, recording: Recording, followed: Collection[str]) -> Device:
    """Return the device with the highest supply of the channels followed, for which the steps must be fine enough."""
    supply = device.supply
    recorded = {name: float(recording[name].max()) for name in (SUPPLY, DORSIFLEXION_SUPPLY) if name in followed}
    highest = max(supply.pressure, recorded.get(SUPPLY, 0.0))
    both = supply.has_one_pressure
    other = max(highest if both else supply.dorsiflexion_pressure, recorded.get(DORSIFLEXION_SUPPLY, 0.0))
    return replace(device, supply=replace(supply, pressure=highest, dorsiflexion_pressure=other))
