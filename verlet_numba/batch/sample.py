"""The points of a sweep: which values its parameters have together.

A point is a row of choices, one a parameter: the value, and where in the sweep it stands.
"""

import itertools
import math
from collections.abc import Collection, Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from verlet_numba.batch.schema import Parameter, Sweep
from verlet_numba.scene.problems import Path

DIGITS = 9      # of a drawn value: the last bits of a logarithm differ between machines, the ids of runs must not


class Choice(NamedTuple):
    """A value of a parameter, and the path in the sweep of what it was taken from."""

    value: Any
    place: Path


def points(sweep: Sweep, whole: Collection[str] = ()) -> Iterator[tuple[Choice, ...]]:
    """Every point in order, the first parameter slowest. `whole`: paths of ranges that take whole numbers alone."""
    names = list(sweep.parameters)
    if sweep.way == "grid":
        return itertools.product(*(levels(sweep, name, whole) for name in names))
    if sweep.way == "zip":
        return zip(*(levels(sweep, name, whole) for name in names), strict=True)
    drawn = cube(sweep.way, sweep.samples or 0, len(names), sweep.seed)
    return (tuple(drawn_value(sweep, name, u, whole) for name, u in zip(names, row, strict=True)) for row in drawn.tolist())


def levels(sweep: Sweep, name: str, whole: Collection[str]) -> list[Choice]:
    """The values of a parameter; of a range `samples` even steps from end to end (the middle, where it is one)."""
    parameter = sweep.parameters[name]
    if parameter.values is not None:
        return [Choice(value, ("parameters", name, "values", k)) for k, value in enumerate(parameter.values)]
    count = sweep.samples or 0
    ends = np.linspace(0, 1, count) if count > 1 else np.array([0.5])
    steps = [within(parameter, u, False) for u in ends.tolist()]
    if name in whole:
        steps = [round(value) for value in steps]
    return [Choice(value, ("parameters", name)) for value in (dict.fromkeys(steps) if sweep.way == "grid" else steps)]


def drawn_value(sweep: Sweep, name: str, u: float, whole: Collection[str]) -> Choice:
    """The value at u in [0, 1) of a parameter's range; values of a list have equal parts of it."""
    parameter = sweep.parameters[name]
    if parameter.values is None:
        return Choice(within(parameter, u, name in whole), ("parameters", name))
    k = min(int(u * len(parameter.values)), len(parameter.values) - 1)
    return Choice(parameter.values[k], ("parameters", name, "values", k))


def within(parameter: Parameter, u: float, whole: bool) -> float | int:
    """The value of a range at u in [0, 1], rounded to DIGITS. Whole numbers have equal shares: each is an interval as wide as 1."""
    assert parameter.min is not None
    assert parameter.max is not None
    low, high = (parameter.min - 0.5, parameter.max + 0.5) if whole else (parameter.min, parameter.max)
    if parameter.distribution == "log_uniform":
        value = low * math.exp(u * math.log(high / low))
    else:
        value = low + u * (high - low)
    value = min(max(round(value) if whole else float(f"{value:.{DIGITS}g}"), parameter.min), parameter.max)
    return int(value) if whole else value


def cube(way: str, samples: int, dimensions: int, seed: int) -> NDArray[np.float64]:
    """(samples, dimensions) points of the unit cube; the same for the same seed. Latin hypercube and Sobol: scipy.stats.qmc."""
    random = np.random.default_rng(seed)
    if way == "random":
        return random.random((samples, dimensions))
    from scipy.stats import qmc

    if way == "lhs":
        return np.asarray(qmc.LatinHypercube(dimensions, rng=random).random(samples))
    whole = qmc.Sobol(dimensions, rng=random).random_base2(max(0, math.ceil(math.log2(samples))))     # balanced as a whole alone
    return np.asarray(whole[:samples])


