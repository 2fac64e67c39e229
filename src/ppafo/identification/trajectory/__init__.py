"""Trajectory fit: any numbers of a device from any recordings of its motion, with intervals and verdicts.

Each file leans on those before it: ``problem`` says what is requested, ``residuals`` runs it, ``information`` is the
algebra, ``ppafo.identification.noise`` the noise of a sensor, ``posterior`` draws it and
the coordinates in turn, ``search`` finds the least misfit, ``uncertainty`` tests the model against itself and gives
intervals and verdicts. ``fitting`` does all of it, ``follow_up`` asks further, ``section`` does so for a problem file.
"""

from ppafo.identification.trajectory.fitting import ChannelFit, TrajectoryFit, fit
from ppafo.identification.trajectory.follow_up import Candidate, Expected, Profile, expected_information, profile
from ppafo.identification.trajectory.problem import Experiment, FreeParameter, Prior, Search, TrajectoryProblem
from ppafo.identification.trajectory.section import trajectory_from_dict

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
