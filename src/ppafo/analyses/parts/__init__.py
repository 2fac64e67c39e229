"""Catalogue of real parts, and the source of each figure."""
