"""Wearers who react: shipped gains of reflexes and changes by disease, and the published body."""
