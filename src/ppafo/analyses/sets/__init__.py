"""Contents of a parameter set: values with their sources, and contradictions between them."""
