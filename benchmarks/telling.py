"""Messages of a benchmark on work in progress."""

import sys


def tell(text: str) -> None:
    """Print a message on work in progress to standard error."""
    print(f"ppafo: {text} ...", file=sys.stderr, flush=True)
