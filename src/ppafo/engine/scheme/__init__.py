"""Formulas of one step of the lane scheme: pure functions with selections only, no powers, no library call but sqrt."""
