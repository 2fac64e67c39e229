"""Drawn tests draw the same every time, and how slow the computer is does not matter.

``pytest --hypothesis-seed N`` draws others.
"""

from hypothesis import HealthCheck, settings

TOO_SLOW = HealthCheck.too_slow
"""It counts seconds, and drawing takes any number of them where other programs want the processor too."""

settings.register_profile("repeatable", derandomize=True, deadline=None, suppress_health_check=[TOO_SLOW])
settings.load_profile("repeatable")
