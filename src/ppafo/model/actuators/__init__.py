"""Actuator types: chamber volumes and torque as functions of angle and pressure."""
