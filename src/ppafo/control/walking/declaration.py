"""Settings that all event-based controllers share, in the order of ``PhaseRules`` and ``SafetyRules``."""

from ppafo.model.declaration import Quantity

PHASE_QUANTITIES = (
    Quantity("load_threshold", "N", "a force sensor counts as loaded above this", 60.0, 1.0, 5.0e3),
    Quantity("unload_threshold", "N", "and as unloaded below this", 30.0, 0.0, 5.0e3),
    Quantity("debounce", "s", "a change of load counts when it has lasted this long", 0.01, 0.0, 0.2),
    Quantity("first_stride_time", "s", "stride time until one was measured", 1.1, 0.3, 5.0),
    Quantity("stride_weight", "1", "weight of a new stride in the moving average", 0.3, 0.0, 1.0),
    Quantity("push_off_start", "1", "share of the stride time at which push-off may begin", 0.4, 0.0, 1.0),
)

SAFETY_QUANTITIES = (
    Quantity("largest_force", "N", "a force above this is no reading", 3.0e3, 100.0, 1.0e5),
    Quantity("lowest_angle", "rad", "an angle below this is no reading", 0.3, -10.0, 10.0),
    Quantity("highest_angle", "rad", "an angle above this is no reading", 2.4, -10.0, 10.0),
    Quantity("longest_phase", "1", "longest time in one phase, in stride times", 1.2, 0.3, 20.0),
    Quantity("frozen_time", "s", "a loaded sensor that shows the same for longer is frozen", 0.25, 0.01, 5.0),
    Quantity("most_toe_strides", "1", "strides in a row that may begin on the toes", 1.0, 0.0, 1.0e6),
    Quantity("flat_from", "1", "from this share of a usual stride on heel and toes are loaded", 0.16, 0.05, 0.6),
    Quantity("flat_to", "1", "and until this share", 0.24, 0.05, 0.6),
    Quantity("lowest_pressure", "Pa_a", "a chamber pressure below this is no reading", 3.0e4, 0.0, 1.0e5),
    Quantity("highest_pressure", "Pa_a", "a chamber pressure above this is no reading", 2.0e6, 1.1e5, 1.0e8),
    Quantity("filled_pressure", "Pa_a", "a filled chamber shows more, a vented one less", 1.25e5, 1.0e4, 1.0e8),
    Quantity("fill_time", "s", "a chamber is filled when the open valve has fed it for this long", 0.05, 1.0e-3, 10.0),
    Quantity("vent_time", "s", "both chambers are vented when the valve has done it for this long", 0.25, 1.0e-3, 10.0),
)
