"""Description of a device: values with provenance, parameter sets as files, and the device in SI units."""

from ppafo.parameters.building import build_device
from ppafo.parameters.loading import list_sets, load_device, load_parameter_set
from ppafo.parameters.overrides import apply_overrides
from ppafo.parameters.parameter_set import ParameterSet

__all__ = ["ParameterSet", "apply_overrides", "build_device", "list_sets", "load_device", "load_parameter_set"]
