"""Model-based design of pneumatic powered orthoses."""

__version__ = "0.1.0"
