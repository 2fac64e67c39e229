"""The scenario of a recording that has none: a free vane from the recorded start, the command left to the recording."""

from dataclasses import replace

from ppafo.parameters.device import Device
from ppafo.signals import Recording
from ppafo.simulation.recorded.inputs import DORSIFLEXION_SUPPLY, LONGEST_STEP, SUPPLY, sample_period
from ppafo.simulation.recorded.start import Start
from ppafo.simulation.scenario import (
    PYTHON_CONTROLLER,
    Control,
    FreeMotion,
    Origin,
    ProfileChoice,
    Scenario,
    Sensors,
)


def recorded_scenario(recording: Recording, device: Device, start: Start, duration: float, file: str) -> Scenario:
    """Return a run of ``duration`` [s] on the clock of a recording, whose command the caller sets step by step."""
    period = sample_period(recording.time)
    return Scenario(
        name=recording.label,
        description="replay of a recording",
        device=device,
        duration=duration,
        time_step=min(period, LONGEST_STEP),
        output_interval=period,
        motion=FreeMotion(start.angle, start.angular_velocity),
        initial_pressure_1=start.pressure_1,
        initial_pressure_2=start.pressure_2,
        control=recorded_control(recording),
        reference=ProfileChoice("constant", {"level": 0.0}),
        sensors=Sensors(),
        assumptions=(),
        origin=Origin(file, device.name, device.valve_name, (), {}),
    )


def recorded_control(recording: Recording) -> Control:
    """Return the control of a run whose command comes from a recording: nobody's, on the clock of the samples."""
    return Control(PYTHON_CONTROLLER, {}, sample_period(recording.time))


def with_highest_supply(device: Device, recording: Recording) -> Device:
    """Return the device with the highest supply that was recorded, for which the steps must be fine enough."""
    supply = device.supply
    recorded = {name: float(recording[name].max()) for name in (SUPPLY, DORSIFLEXION_SUPPLY) if name in recording}
    highest = max(supply.pressure, recorded.get(SUPPLY, 0.0))
    both = supply.has_one_pressure
    other = max(highest if both else supply.dorsiflexion_pressure, recorded.get(DORSIFLEXION_SUPPLY, 0.0))
    return replace(device, supply=replace(supply, pressure=highest, dorsiflexion_pressure=other))
