"""Time stepping: the lane scheme that runs many devices at once."""
