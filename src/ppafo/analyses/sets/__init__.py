"""What a parameter set says of itself: its values with their sources, and where it contradicts itself."""
