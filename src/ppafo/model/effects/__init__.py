"""Physical effects in addition to the paper's equations: one module each, and the catalogue of effects."""
