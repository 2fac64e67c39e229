"""Which configuration is better, by how much, and how surely?"""
