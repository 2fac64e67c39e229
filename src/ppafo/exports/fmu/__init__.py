"""A scenario or a walk as a functional mock-up unit: sources inside, no Python at run time.

The unit holds the closed loop, or the plant alone: valve, gas and supply under a command, on a vane that is
unconstrained or moved. It is for co-simulation.
"""
