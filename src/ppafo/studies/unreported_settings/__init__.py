"""Which settings of its torque task the paper leaves unsaid, and what its reported results imply about them."""

from ppafo.studies.unreported_settings.study import Family, infer_settings

__all__ = ["Family", "infer_settings"]
