"""Questions beyond one run: a folder each, with what it declares, its file, its solution, its answer; catalogue.py."""
