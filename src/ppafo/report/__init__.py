"""What an analysis found, and the one way in which it becomes text, JSON, a page and a folder."""
