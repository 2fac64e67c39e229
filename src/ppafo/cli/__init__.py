"""Command line of ppafo: one thin file per subcommand."""
