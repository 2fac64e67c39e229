"""The kinds of actuator: volume and torque over angle and pressure."""
