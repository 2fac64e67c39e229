"""Hardware in the loop: a scenario's plant in real time at a wire, with the controller on the other side."""
