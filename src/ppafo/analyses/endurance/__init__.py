"""How long does one bottle of gas last, how cold does it get, and why does it end?"""
