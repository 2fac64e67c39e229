"""Time stepping: the lane scheme that runs many devices at once, and the reference solver that judges it."""
