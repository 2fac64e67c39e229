"""Functional mock-up unit (FMU) of a scenario or walk: with sources, without Python at run time.

The unit contains the closed loop, or the plant alone: valve, gas and supply under a command, with a free or prescribed
vane. It is for co-simulation.
"""
