"""Gas bottles with regulators: files, fluid properties, and the bottle in SI units."""
