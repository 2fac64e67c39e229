"""Morris and Sobol as SALib has them: designs in the unit cube in, indices out.

A design is made of blocks that belong together: one trajectory of Morris, one base point of Sobol with its
exchanged copies. A block is the least that can be left out.
"""

import importlib.util
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from ppafo.errors import StudyError
from ppafo.studies.sweep.sampling.distributions import Floats

RESAMPLES = 1000
"""Bootstrap resamples of the blocks behind every band."""

TAIL = 0.005
"""Morris moves between the 0.5 and the 99.5 % quantile of each distribution: a normal one has no end to stand on."""

_LEVELS = 4


@dataclass(frozen=True, slots=True)
class Indices:
    """Indices by name, each (paths,), and the half width of the band around each one that has a band."""

    values: Mapping[str, Floats]
    bands: Mapping[str, Floats]


class Method(Protocol):
    """A design and its evaluation."""

    @property
    def name(self) -> str:
        """Name in ``METHODS``."""
        ...

    @property
    def shown(self) -> tuple[str, str]:
        """The two indices that are drawn; the first one ranks."""
        ...

    @property
    def fewest(self) -> int:
        """Least number of blocks."""
        ...

    @property
    def most(self) -> int:
        """Largest number of blocks."""
        ...

    @property
    def sizes_told(self) -> str:
        """What blocks are called."""
        ...

    @property
    def block_told(self) -> str:
        """What one block is called."""
        ...

    def block_rows(self, dimensions: int) -> int:
        """Return how many runs belong together."""
        ...

    def design(self, dimensions: int, blocks: int, seed: int) -> Floats:
        """Return shares in (0, 1), shape (blocks * block_rows, dimensions), block after block."""
        ...

    def indices(self, design: Floats, values: Floats, confidence: float, seed: int) -> Indices:
        """Return the indices of values (blocks * block_rows,) of a design or of some of its blocks."""
        ...


@dataclass(frozen=True, slots=True)
class Sobol:
    """Shares of the variance: first-order (each value alone) and total (with all its interactions).

    Saltelli's design on a scrambled Sobol sequence; estimators of Saltelli et al. (2010) and Sobol et al. (2007) in
    SALib.
    """

    name: str = "sobol"
    shown: tuple[str, str] = ("total", "first")
    fewest: int = 64
    most: int = 2**17
    sizes_told: str = "base points"
    block_told: str = "base point"

    def block_rows(self, dimensions: int) -> int:
        """Return how many runs belong together."""
        return dimensions + 2

    def design(self, dimensions: int, blocks: int, seed: int) -> Floats:
        """Return shares in (0, 1); the number of blocks has to be a power of 2."""
        if blocks & (blocks - 1):
            raise StudyError(f"samples = {blocks}: Sobol indices need a power of 2, such as {1 << blocks.bit_length()}")
        _check_salib()
        from SALib.sample import sobol

        shares = sobol.sample(_problem(dimensions), blocks, calc_second_order=False, seed=seed)
        return np.asarray(np.clip(shares, 2.0**-53, 1.0 - 2.0**-53))

    def indices(self, design: Floats, values: Floats, confidence: float, seed: int) -> Indices:
        """Return ``first`` and ``total`` with bands."""
        from SALib.analyze import sobol

        found = sobol.analyze(
            _problem(design.shape[1]),
            values,
            calc_second_order=False,
            num_resamples=RESAMPLES,
            conf_level=confidence,
            seed=seed,
        )
        return _indices(found, {"total": ("ST", "ST_conf"), "first": ("S1", "S1_conf")})


@dataclass(frozen=True, slots=True)
class Morris:
    """Elementary effects: how much a metric changes when one value goes through its whole range, here and there.

    ``mean_effect`` is the mean absolute effect in the unit of the metric (Campolongo et al., 2007), ``spread`` its
    standard deviation: large where the effect depends on the other values.
    """

    name: str = "morris"
    shown: tuple[str, str] = ("mean_effect", "spread")
    fewest: int = 8
    most: int = 2**14
    sizes_told: str = "trajectories"
    block_told: str = "trajectory"

    def block_rows(self, dimensions: int) -> int:
        """Return how many runs belong together."""
        return dimensions + 1

    def design(self, dimensions: int, blocks: int, seed: int) -> Floats:
        """Return shares from TAIL to 1 - TAIL."""
        _check_salib()
        from SALib.sample import morris

        design = morris.sample(_problem(dimensions), blocks, num_levels=_LEVELS, seed=seed)
        return np.asarray(TAIL + (1.0 - 2.0 * TAIL) * design)

    def indices(self, design: Floats, values: Floats, confidence: float, seed: int) -> Indices:
        """Return ``mean_effect`` with a band, and ``spread`` [unit of the metric]."""
        from SALib.analyze import morris

        found = morris.analyze(
            _problem(design.shape[1]),
            (design - TAIL) / (1.0 - 2.0 * TAIL),
            values,
            num_resamples=RESAMPLES,
            conf_level=confidence,
            num_levels=_LEVELS,
            seed=seed,
        )
        return _indices(found, {"mean_effect": ("mu_star", "mu_star_conf"), "spread": ("sigma", "")})


METHODS: dict[str, Method] = {"sobol": Sobol(), "morris": Morris()}
"""To add a method: a class with these four functions, and its line here."""


def _check_salib() -> None:
    if importlib.util.find_spec("SALib") is None:
        raise StudyError("sensitivity needs SALib, which is not installed: pip install 'ppafo[studies]'")


def _problem(dimensions: int) -> dict[str, Any]:
    names = [f"x{number}" for number in range(dimensions)]
    return {"num_vars": dimensions, "names": names, "bounds": [[0.0, 1.0]] * dimensions}


def _indices(found: Mapping[str, Sequence[float]], names: Mapping[str, tuple[str, str]]) -> Indices:
    def column(key: str) -> Floats:
        return np.asarray(found[key], dtype=np.float64)

    return Indices(
        {name: column(value) for name, (value, _) in names.items()},
        {name: column(band) for name, (_, band) in names.items() if band},
    )
