"""Functions of the commands: typed and documented, importing their implementation only when called."""
