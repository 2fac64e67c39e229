"""How fast the engine is and how often its intervals hold: run from a checkout with ``python -m benchmarks``."""
