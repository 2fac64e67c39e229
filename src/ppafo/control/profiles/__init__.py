"""Functions of time that a reference or a prescribed angle can follow, one module each."""
