"""Makers of what the package ships, and studies of it: run from a checkout, never imported by the package."""
