"""File formats of gait recordings, one module each; ``reading.py`` has the catalogue."""
