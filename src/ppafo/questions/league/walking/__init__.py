"""How good is each controller on a leg that walks, and how far is it from the best that is possible?"""
