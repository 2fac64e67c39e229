"""The device in OpenSim: ``CoSimulation`` of gas and skeleton, and what the muscles of an ankle have to give.

    from ppafo.worlds.opensim import CoSimulation, ankle_muscles

Needs the extra ``opensim``. How: docs/how-to/opensim.md.
"""

import sys

if "casadi" in sys.modules:
    raise ImportError(
        "ppafo.worlds.opensim: casadi is loaded in this process, and OpenSim brings another one that breaks it; "
        "use OpenSim in a process of its own"
    )

try:
    import opensim
except ImportError as error:
    raise ImportError(
        "ppafo.worlds.opensim needs OpenSim, which has wheels up to Python 3.13: pip install 'ppafo[opensim]'"
    ) from error

from ppafo.worlds.opensim.device import CoSimulation, DeviceAtAnkle, Sample, follow_motion, load_model
from ppafo.worlds.opensim.muscles import AnkleMuscles, ankle_muscles

opensim.Logger.removeFileSink()
opensim.Logger.setLevelString("Error")
"""Else OpenSim leaves a file opensim.log wherever it is started, and a line for every step on the screen."""

__all__ = [
    "AnkleMuscles",
    "CoSimulation",
    "DeviceAtAnkle",
    "Sample",
    "ankle_muscles",
    "follow_motion",
    "load_model",
]
