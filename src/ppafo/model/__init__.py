"""The physics: pure functions on floats, one module per component. No engine, no files, no units."""
