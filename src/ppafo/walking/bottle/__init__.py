"""Gas bottle that supplies a walking device: section of the walk file, state over time, coupled simulation."""
