"""Phases of one integration step as plain functions: ``phases`` in the order of execution, called by ``loop``.

A function takes ``parts``, the components of the device, which never change in a run; ``lane``, the numbers of one run
by group (``lane.plant``, ``lane.state``); and ``now``, the present step of all runs. Groups set by one phase are
available to later phases; a group without rows in the program (``Program.step_rows``) exists only inside one phase.

A debugger can step through all of this code. Compiled code is generated from the same functions (``engine.generator``):
decisions that depend on ``parts`` alone are made at generation, and groups become arguments and return values. Numeric
choices must be conditional expressions, not branches, and phases must not divide integers: ``Now`` provides the
required indices.
"""
