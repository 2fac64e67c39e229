"""Questions beyond one run: a folder each, with its file, its solution, its answer and its figures; catalogue.py."""
