"""The virtual test rig: a richer model than the identified one, which records synthetic data as a laboratory would."""

from ppafo.rig.preset import Preset, list_presets, load_preset
from ppafo.rig.record import RigRecording, record

__all__ = ["Preset", "RigRecording", "list_presets", "load_preset", "record"]
