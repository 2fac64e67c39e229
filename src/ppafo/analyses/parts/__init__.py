"""Which real parts are there, and where does each figure come from?"""
