"""Event-based walking on whole numbers: readings are counts of a converter, times are counts of samples."""
