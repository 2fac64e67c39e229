"""Questions beyond one run: a folder each, with its file, its solution and its answer."""
