"""Controllers of walking, which also measure the forces under the foot. One module each."""
