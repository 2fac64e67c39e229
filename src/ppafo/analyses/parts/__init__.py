"""Catalogue of real parts with the source of each figure."""
