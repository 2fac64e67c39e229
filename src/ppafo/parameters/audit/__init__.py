"""Checks a parameter set for contradictions: any set, with whatever values it has."""

from ppafo.parameters.audit.evidence import Finding, NamedValue, Severity, Side
from ppafo.parameters.audit.report import audit

__all__ = ["Finding", "NamedValue", "Severity", "Side", "audit"]
