"""Replay scenario: device at the sample times of a recording, without a controller, and motions of its vane."""

from dataclasses import replace

from ppafo.parameters.device import VANE, Device, Orifice
from ppafo.signals import Recording
from ppafo.simulation.recorded.channels import ANGLE, LONGEST_STEP, sample_period
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
    """Return a scenario of ``duration`` [s] on the clock of a recording; the caller sets its command step by step.

    The vane moves freely from its initial state unless another motion is given. ``file`` is the origin stated in the
    scenario.
    """
    period = sample_period(recording.time)
    return Scenario(
        name=recording.label,
        description="replay of a recording",
        device=device,
        run=RunSettings(duration, min(period, LONGEST_STEP), period),
        motion=motion or FreeMotion(start.angle, start.angular_velocity),
        initial=Initial(start.pressure_1, start.pressure_2),
        controller=Control(PYTHON_CONTROLLER, {}, period),
        reference=ProfileChoice("constant", {"level": 0.0}),
        sensors=Sensors(),
        assumptions=(),
        origin=Origin(file, device.name, device.valve_name, (), {}),
    )


def with_fixed_volume(device: Device, volume: float) -> tuple[Device, dict[str, float]]:
    """Return the device with a fixed volume [m^3] instead of chamber 1, and initial values for a replay [SI].

    There is no leak, for any actuator. The initial values, by channel, are the vane at the lower stop and chamber 2 at
    atmospheric pressure; the pressure in the volume is given by the caller.
    """
    leak = device.actuator.leak
    shut = replace(leak, area=0.0) if isinstance(leak, Orifice) else replace(leak, sonic_conductance=0.0)
    fixed = replace(device.actuator, dead_volume_1=volume, leak=shut, kind=VANE, settings={}, table=None)
    start = {ANGLE: device.actuator.angle_min, "pressure_2": device.supply.atmospheric_pressure}
    return replace(device, actuator=fixed), start
