"""Design of a device: for a wearer, for a torque profile, or Pareto-optimal in error, gas and mass."""
