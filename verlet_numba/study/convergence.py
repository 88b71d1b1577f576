"""What is true of a scene: a converged run with an error bar of its own, and how long any run can be predicted."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from verlet_numba.study.trial import Outcome

TWINS = 1e-10           # of the scene's extent: how far apart twin runs start
PARTED = 1e-2           # of the extent: twins this far apart have nothing to do with each other
LEAST_ORDER, BEST_ORDER = 0.5, 2.0


@dataclass(frozen=True)
class Reference:
    """The run with the shortest step, and how far it may be from the truth."""

    outcome: Outcome
    substeps: int
    order: float            # of convergence, from runs with one, two and four times its step
    bar: float              # m, error of its positions


def extent(outcome: Outcome) -> float:
    """The largest side of the box that holds all that the particles pass through, m; 1 if they do not spread."""
    points = outcome.position.reshape(-1, 3)
    size = float(np.ptp(points, axis=0).max()) if len(points) else 0.0
    return size or 1.0


def distance(one: Outcome, other: Outcome, until: float = np.inf) -> float:
    """Root mean square over particles of the distance between two runs [m], the largest of the times up to `until`."""
    if not (one.sound and other.sound):
        return float("inf")
    return float(apart(one, other)[one.time <= until].max(initial=0.0))


def apart(one: Outcome, other: Outcome) -> NDArray[np.float64]:
    """(T,) the same at each time, m."""
    squares = np.sum((one.position - other.position) ** 2, axis=2)
    return np.sqrt(squares.mean(axis=1)) if squares.shape[1] else np.zeros(len(one.time))


def horizon(one: Outcome, twin: Outcome) -> float:
    """The time [s] at which twins that started TWINS apart have parted; infinite if they never do."""
    parted = np.flatnonzero(apart(one, twin) > PARTED * extent(one))
    return float(one.time[parted[0]]) if len(parted) else float("inf")


def richardson(coarse: Outcome, middle: Outcome, fine: Outcome, substeps: int, until: float) -> Reference:
    """The finest of three runs whose steps halve, with its error bar (Richardson 1911): the last change over 2^p - 1.

    p, the order of convergence, is log2 of the last two changes' ratio, held between what a method may have. A change that
    does not shrink leaves the larger one as the bar.
    """
    before, last = distance(coarse, middle, until), distance(middle, fine, until)
    ratio = before / last if last > 0.0 else 2.0**BEST_ORDER
    order = float(np.clip(np.log2(max(ratio, 1e-9)), LEAST_ORDER, BEST_ORDER))
    return Reference(fine, substeps, order, max(last / (2.0**order - 1.0), last if ratio < 1.0 else 0.0))
