"""Physics as pure functions on floats, one module per component. Independent of engine, files and unit conversion."""
