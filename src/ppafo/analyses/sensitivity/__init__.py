"""Sensitivity of a metric to uncertain values: Sobol indices, Shapley effects and signed changes."""
