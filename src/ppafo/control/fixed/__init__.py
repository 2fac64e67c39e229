"""Controllers on whole numbers of at most 32 bits, as a processor without a multiplier computes them."""
