"""Names of the joint driven by an actuator, and of its two movements."""

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
"""Opposite movement by movement of a joint."""


@dataclass(frozen=True, slots=True)
class JointNames:
    """Joint driven by the actuator: its name, and the movements of increasing and of decreasing angle."""

    name: str = "ankle"
    positive: str = "plantarflexion"
    negative: str = "dorsiflexion"

    def said(self, text: str) -> str:
        """Replace the ankle's words in a text by the words of this joint."""
        words = zip(("ankle", "plantarflexion", "dorsiflexion"), (self.name, self.positive, self.negative), strict=True)
        for usual, own in words:
            text = text.replace(usual, own).replace(usual.capitalize(), own.capitalize())
        return text


ANKLE = JointNames()
"""Joint of a set that does not name one."""
