"""Whether a stride can be true: limits wide enough for impaired walking, that exclude what no leg does."""
