"""Wearers who react: shipped gains of reflexes, the published body, and the search that finds gains."""
