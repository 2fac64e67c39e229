"""Forms of gait recordings that the package reads, a file each; ``reading.py`` has the catalogue of them."""
