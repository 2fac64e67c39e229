"""Settings that event-based controllers share, in the order of the fields that they fill."""

from collections.abc import Mapping
from dataclasses import replace

from ppafo.model.declaration import PRESSURE_LAG, VALVE_LAG, Quantity

PHASE_QUANTITIES = (
    Quantity("load_threshold", "N", "a force sensor counts as loaded above this", 60.0, 1.0, 5.0e3),
    Quantity("unload_threshold", "N", "and as unloaded below this", 30.0, 0.0, 5.0e3),
    Quantity("debounce", "s", "a change of load counts when it has lasted this long", 0.01, 0.0, 0.2),
    Quantity("first_stride_time", "s", "stride time until one has been measured", 1.1, 0.3, 5.0),
    Quantity("stride_weight", "1", "weight of a new stride in the moving average", 0.3, 0.0, 1.0),
    Quantity("push_off_start", "1", "fraction of the stride time at which push-off may begin", 0.4, 0.0, 1.0),
)

SAFETY_QUANTITIES = (
    Quantity("lowest_force", "N", "a force below this is not a valid reading", -40.0, -1.0e5, 0.0),
    Quantity("largest_force", "N", "a force above this is not a valid reading", 3.0e3, 100.0, 1.0e5),
    Quantity("lowest_angle", "rad", "an angle below this is not a valid reading", 0.3, -10.0, 10.0),
    Quantity("highest_angle", "rad", "an angle above this is not a valid reading", 2.4, -10.0, 10.0),
    Quantity("longest_phase", "1", "longest stance or swing, in stride times", 1.2, 0.3, 20.0),
    Quantity("frozen_time", "s", "a loaded sensor whose reading does not change for longer is frozen", 0.24, 0.01, 5.0),
    Quantity("most_toe_strides", "1", "strides in a row that may be on the toes alone", 1.0, 0.0, 1.0e6),
    Quantity(
        "flat_from", "1", "from this fraction of a steady stride on, heel and toes are both loaded", 0.16, 0.05, 0.6
    ),
    Quantity("flat_to", "1", "and until this fraction", 0.24, 0.05, 0.6),
    Quantity("lowest_pressure", "Pa_a", "a chamber pressure below this is not a valid reading", 4.5e4, 0.0, 1.0e5),
    Quantity("highest_pressure", "Pa_a", "a chamber pressure above this is not a valid reading", 2.0e6, 1.1e5, 1.0e8),
    Quantity(
        "filled_pressure", "Pa_a", "a filled chamber has a higher pressure, a vented one a lower", 1.25e5, 1.0e4, 1.0e8
    ),
    Quantity("fill_time", "s", "a chamber is filled when the open valve has fed it for this long", 0.05, 1.0e-3, 10.0),
    Quantity(
        "vent_time", "s", "both chambers are vented when the valve has vented them for this long", 0.25, 1.0e-3, 10.0
    ),
    Quantity("shortest_swing", "1", "shortest swing that is seen in a steady stride, fraction of it", 0.25, 0.0, 0.6),
    Quantity("resume_strides", "1", "good strides in a row after which a pause ends", 2.0, 1.0, 1.0e3),
    Quantity("largest_drop", "N", "no force as large as this is gone within a sample", 300.0, 10.0, 1.0e5),
    Quantity("lowest_flat_angle", "rad", "no ankle has less while the foot must stand flat", 1.22, -10.0, 10.0),
    Quantity("highest_flat_angle", "rad", "no ankle has more while the foot must stand flat", 1.92, -10.0, 10.0),
    Quantity(
        "follow_time",
        "s",
        "a pressure follows the valve within this, and the lags of valve and sensor",
        8.0e-3,
        0.0,
        1.0,
        follows=(VALVE_LAG, PRESSURE_LAG),
    ),
    Quantity("highest_toe_off_angle", "rad", "no ankle has more while its toes still carry", 2.06, -10.0, 10.0),
)

HOLD_QUANTITIES = (
    Quantity("swing_angle", "rad", "angle about which the lifted foot is held", 1.28, 0.5, 2.5),
    Quantity("hold_stiffness", "N m/rad", "requested torque per angle from it", 3.7, 0.0, 1.0e3),
    Quantity("hold_damping", "N m s/rad", "requested torque against the angle's rate", 0.35, 0.0, 1.0e3),
    Quantity("angle_rate_filter", "s", "time constant of the filter on the angle's rate", 0.006, 0.0, 1.0),
)

PUSH_OFF_QUANTITIES = (
    Quantity("peak_torque", "N m", "peak of the torque in push-off", 5.0, 0.0, 1.0e3),
    Quantity("peak_time", "1", "phase of the peak, fraction of the stride time", 0.53, 0.1, 0.9),
    Quantity("rise_time", "1", "fraction of the stride time from zero to the peak", 0.15, 0.01, 0.8),
    Quantity("fall_time", "1", "fraction of the stride time from the peak to zero", 0.09, 0.01, 0.8),
)

ASSISTANCE_QUANTITIES = (
    *HOLD_QUANTITIES,
    Quantity("landing_peak_torque", "N m", "peak of the torque in dorsiflexion while landing", 5.0, 0.0, 1.0e3),
    Quantity("landing_peak_time", "1", "phase of that peak", 0.046, 0.0, 0.9),
    Quantity("landing_rise_time", "1", "fraction of the stride time from zero to that peak", 0.09, 0.01, 0.8),
    Quantity("landing_fall_time", "1", "fraction of the stride time from that peak to zero", 0.078, 0.01, 0.8),
    *PUSH_OFF_QUANTITIES,
    Quantity("swing_peak_torque", "N m", "peak of the torque in dorsiflexion in the swing", 2.7, 0.0, 1.0e3),
    Quantity("swing_peak_time", "1", "phase of that peak", 0.805, 0.1, 1.0),
    Quantity("swing_rise_time", "1", "fraction of the stride time from zero to that peak", 0.24, 0.01, 0.8),
    Quantity("swing_fall_time", "1", "fraction of the stride time from that peak to zero", 0.14, 0.01, 0.8),
    Quantity(
        "largest_torque",
        "N m",
        "limit of the requested torque, either direction; about what 50 psi_g holds",
        5.0,
        0.0,
        1.0e3,
    ),
)
"""Fields of ``Assistance`` in order."""

ASSISTING_QUANTITIES = (*ASSISTANCE_QUANTITIES, *PHASE_QUANTITIES, *SAFETY_QUANTITIES)
"""What every law declares after its own settings that follows ``assistance``."""


def with_defaults(quantities: tuple[Quantity, ...], defaults: Mapping[str, float]) -> tuple[Quantity, ...]:
    """The quantities of a law with other defaults [SI] for walking, by name; the others keep theirs."""
    assert set(defaults) <= {item.name for item in quantities}, "a default belongs to a quantity"
    return tuple(replace(item, default=defaults.get(item.name, item.default)) for item in quantities)
