"""From recorded files to a gait: tables, what their columns mean, events, strides, and whether that can be true."""

from ppafo.gait.recorded.importing import ImportedGait, ImportSettings, import_gait

__all__ = ["ImportSettings", "ImportedGait", "import_gait"]
