"""Trajectory fit: any numbers of a device from any recordings of its motion, with intervals and verdicts."""

from ppafo.identification.trajectory.channels import ChannelFit
from ppafo.identification.trajectory.document import trajectory_from_dict
from ppafo.identification.trajectory.expected import Candidate, Expected, expected_information
from ppafo.identification.trajectory.experiment import Experiment
from ppafo.identification.trajectory.fitting import fit
from ppafo.identification.trajectory.problem import Search, TrajectoryProblem
from ppafo.identification.trajectory.profiles import Profile, profile
from ppafo.identification.trajectory.ranges import FreeParameter, Prior
from ppafo.identification.trajectory.result import TrajectoryFit

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
