"""Formulas of one integration step: pure functions without branches, powers or library calls other than sqrt."""
