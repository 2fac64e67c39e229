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
)
