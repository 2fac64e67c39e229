"""How low, or how high, may a value be so that a condition on a metric holds?"""
