"""Physical effects beside the paper's equations: one module each, and the catalogue of them."""
