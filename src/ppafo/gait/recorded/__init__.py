"""Import of a gait from recorded files: tables, meaning of the columns, events and strides."""

from ppafo.gait.recorded.importing import ImportedGait, import_gait
from ppafo.gait.recorded.mapping import ImportSettings

__all__ = ["ImportSettings", "ImportedGait", "import_gait"]
