"""The way of one device through a step, in plain functions: read ``phases`` downwards, then ``loop``, its caller.

A function takes ``parts``, what the device is made of, which never changes in a run; ``lane``, the numbers of one run
by group (``lane.plant``, ``lane.state``); and ``now``, the step of all runs. What a phase sets on its lane the later
ones find there; a group that the program has no rows for (``Program.step_rows``) lives inside one phase.

A debugger goes through all of this. What is compiled is made of the same functions (``engine.generator``): what asks
``parts`` alone is decided while they are composed, and a group becomes an argument or a result. Choices between numbers
stay choices, not branches, and no phase divides whole numbers: ``Now`` has what that would be for.
"""
