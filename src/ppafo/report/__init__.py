"""Findings of an analysis, and their output as text, JSON, page and folder."""
