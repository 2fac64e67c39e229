"""The scenario of a replay: a device on the clock of a recording, with no controller, and motions of its vane."""

from dataclasses import replace

from ppafo.parameters.device import VANE, Device, Orifice
from ppafo.signals import Recording
from ppafo.simulation.recorded.channels import ANGLE
from ppafo.simulation.recorded.clock import LONGEST_STEP, sample_period
from ppafo.simulation.recorded.rest import ReplayStart
from ppafo.simulation.scenario import (
    PYTHON_CONTROLLER,
    Control,
    FreeMotion,
    Initial,
    Origin,
    PrescribedMotion,
    ProfileChoice,
    RunSettings,
    Scenario,
    Sensors,
)


def replay_scenario(
    recording: Recording,
    device: Device,
    start: ReplayStart,
    duration: float,
    file: str,
    motion: FreeMotion | PrescribedMotion | None = None,
) -> Scenario:
    """Return a run of ``duration`` [s] on the clock of a recording, whose command the caller sets step by step.

    The vane moves freely from where it starts unless another motion is given. ``file`` is what the scenario says that
    it is from.
    """
    period = sample_period(recording.time)
    return Scenario(
        name=recording.label,
        description="replay of a recording",
        device=device,
        run=RunSettings(duration, min(period, LONGEST_STEP), period),
        motion=motion or FreeMotion(start.angle, start.angular_velocity),
        initial=Initial(start.pressure_1, start.pressure_2),
        controller=replay_control(recording),
        reference=ProfileChoice("constant", {"level": 0.0}),
        sensors=Sensors(),
        assumptions=(),
        origin=Origin(file, device.name, device.valve_name, (), {}),
    )


def replay_control(recording: Recording) -> Control:
    """Return the control of a run whose command comes from a recording: no controller, the period of the samples."""
    return Control(PYTHON_CONTROLLER, {}, sample_period(recording.time))


def locked_vane(angle: float) -> PrescribedMotion:
    """Return the motion of a vane that is held at an angle [rad]: both chambers are fixed volumes."""
    return PrescribedMotion(ProfileChoice("constant", {"level": angle}), "locked")


def with_fixed_volume(device: Device, volume: float) -> tuple[Device, dict[str, float]]:
    """Return the device with a fixed volume [m^3] in the place of chamber 1, and what a replay of it starts from [SI].

    Whatever the actuator, nothing leaks. The start by channel, beside the pressure in the volume: the vane at the lower
    stop, chamber 2 at the atmosphere.
    """
    leak = device.actuator.leak
    shut = replace(leak, area=0.0) if isinstance(leak, Orifice) else replace(leak, sonic_conductance=0.0)
    fixed = replace(device.actuator, dead_volume_1=volume, leak=shut, kind=VANE, settings={}, table=None)
    start = {ANGLE: device.actuator.angle_min, "pressure_2": device.supply.atmospheric_pressure}
    return replace(device, actuator=fixed), start
