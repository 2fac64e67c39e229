"""File formats of gait recordings, one module each; ``FORMS`` in ``source.py`` is the catalogue."""
