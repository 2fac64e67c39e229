"""The device on a leg that walks: wearer, gait, sensors and event-based control put together, and what came of it."""
