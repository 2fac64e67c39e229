"""How sure is a number, and how many runs does it take?"""
