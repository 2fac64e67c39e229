"""A controller on a small processor: laws in fixed point, their firmware, and the processor in the loop."""
