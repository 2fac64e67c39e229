"""Hardware in the loop: the plant of a scenario in real time on a link to an external controller."""
