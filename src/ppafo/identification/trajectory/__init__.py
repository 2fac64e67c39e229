"""Trajectory fit: any numbers of a device from any recordings of its motion, with intervals and verdicts.

Rooms, each leaning on those before it: ``experiment`` and ``problem`` say what is requested, ``preparation`` and
``residuals`` run it, ``information`` and ``search`` find the least misfit. ``whitening`` and ``sensor_noise`` are the
noise of a sensor, with which ``weighing`` searches on; ``posterior`` draws both, ``misfit`` tests the model against
itself, ``uncertainty`` gives intervals and verdicts. ``fitting`` does all of it and returns ``result``, ``follow_up``
asks further. ``section``, ``document`` and ``outcome`` do so for a problem file.
"""

from ppafo.identification.trajectory.document import trajectory_from_dict
from ppafo.identification.trajectory.experiment import Experiment
from ppafo.identification.trajectory.fitting import fit
from ppafo.identification.trajectory.follow_up import Candidate, Expected, Profile, expected_information, profile
from ppafo.identification.trajectory.problem import FreeParameter, Prior, Search, TrajectoryProblem
from ppafo.identification.trajectory.result import ChannelFit, TrajectoryFit

__all__ = [
    "Candidate",
    "ChannelFit",
    "Expected",
    "Experiment",
    "FreeParameter",
    "Prior",
    "Profile",
    "Search",
    "TrajectoryFit",
    "TrajectoryProblem",
    "expected_information",
    "fit",
    "profile",
    "trajectory_from_dict",
]
