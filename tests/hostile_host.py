"""A host program that has set up its process in its own way: ``pytest -p tests.hostile_host``.

Results must not depend on it. Decimals have few digits and round up, NumPy raises, warnings are errors, numbers and
names of days are of another locale where this computer has one, and what is printed of arrays is short.
"""

import contextlib
import decimal
import locale
import warnings

import numpy as np
import pytest
import xarray

_LOCALES = ("de_DE.UTF-8", "fr_FR.UTF-8", "nl_NL.UTF-8", "tr_TR.UTF-8")


def turn_hostile() -> None:
    """Set the state of this process, and of threads that it starts, to what a host may have made of it."""
    for context in (decimal.DefaultContext, decimal.getcontext()):
        context.prec = 4
        context.rounding = decimal.ROUND_UP
    np.seterr(all="raise")
    np.set_printoptions(precision=2, threshold=3)
    xarray.set_options(keep_attrs=False, display_max_rows=1)
    warnings.simplefilter("error")
    # A study without a folder keeps its runs in one that goes with the last reference to its results, as Python says.
    warnings.filterwarnings("ignore", message="Implicitly cleaning up", category=ResourceWarning)
    for name in _LOCALES:
        with contextlib.suppress(locale.Error):
            locale.setlocale(locale.LC_ALL, name)
            break


@pytest.fixture(autouse=True)
def _hostile_host() -> None:
    turn_hostile()
