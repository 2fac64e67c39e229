"""The designs that no other beats in error, gas and mass, in the tasks of a file."""
