"""One step of the lane scheme, as pure functions: every choice a select, no power, no library function but sqrt."""
