"""The version of the package, in a module that imports nothing, so that every other one may ask for it."""

__version__ = "0.2.0"
