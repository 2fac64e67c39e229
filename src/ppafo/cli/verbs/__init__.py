"""Command functions: typed and documented, with implementations imported only when called."""
