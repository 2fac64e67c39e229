"""Sensitivity of metrics to uncertain values: Sobol indices, Shapley effects and signed changes."""
