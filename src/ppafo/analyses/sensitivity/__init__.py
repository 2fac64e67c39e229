"""Which uncertain value matters? Sobol indices, Shapley effects, and the signed change of a metric."""
