"""Translation of a composed Python module into other languages: type inference and code generators."""
