"""Joint that an actuator turns, in words: its name and its two directions."""

from dataclasses import dataclass

OPPOSITES = {
    "plantarflexion": "dorsiflexion",
    "flexion": "extension",
    "abduction": "adduction",
    "inversion": "eversion",
    "pronation": "supination",
    "internal rotation": "external rotation",
}
OPPOSITES |= {second: first for first, second in OPPOSITES.items()}
"""Opposite of each joint movement."""


@dataclass(frozen=True, slots=True)
class JointNames:
    """Joint that the actuator turns, in words: its name, the movement of a growing angle, and of a falling one."""

    name: str = "ankle"
    positive: str = "plantarflexion"
    negative: str = "dorsiflexion"

    def said(self, text: str) -> str:
        """Return a text about an ankle as one about this joint."""
        words = zip(("ankle", "plantarflexion", "dorsiflexion"), (self.name, self.positive, self.negative), strict=True)
        for usual, own in words:
            text = text.replace(usual, own).replace(usual.capitalize(), own.capitalize())
        return text


ANKLE = JointNames()
"""The joint of a set that names none."""
