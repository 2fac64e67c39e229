"""Simulated test bench: a detailed model beyond the identified model, which records synthetic data."""

from ppafo.rig.experiments import RigRecording, record
from ppafo.rig.preset import Preset, list_presets, load_preset

__all__ = ["Preset", "RigRecording", "list_presets", "load_preset", "record"]
