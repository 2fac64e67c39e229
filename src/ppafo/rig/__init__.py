"""Simulated test bench: runs of the model with the errors of sensors, recorded as a laboratory would, synthetic."""

from ppafo.rig.experiments import RigRecording, record
from ppafo.rig.preset import Preset, list_presets, load_preset

__all__ = ["Preset", "RigRecording", "list_presets", "load_preset", "record"]
