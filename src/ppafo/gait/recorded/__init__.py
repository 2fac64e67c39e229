"""From recorded files to a gait: tables, what their columns mean, events and strides."""

from ppafo.gait.recorded.importing import ImportedGait, import_gait
from ppafo.gait.recorded.mapping import ImportSettings

__all__ = ["ImportSettings", "ImportedGait", "import_gait"]
