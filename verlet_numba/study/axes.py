"""Which settings `accuracy` compares: the user's axes as a full grid, or a star of the solver's own about the scene's."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from typing import Any

from verlet_numba.scene.problems import SceneError
from verlet_numba.scene.schema import Scene
from verlet_numba.scene.schema_bodies import Body
from verlet_numba.scene.source import compose

MOST = 40                                   # settings, by default
FACTORS = (0.25, 0.5, 1, 2, 4)              # of the scene's substeps
PASSES = (1, 2, 4, 8)
CHOICES: dict[str, tuple[Any, ...]] = {
    "solver.gradient": ("current", "step_start"), "solver.order": ("sequential", "constraint_graph", "lines"),
    "solver.square_root": ("exact", "approximate"), "solver.precision": ("float64", "float32"), "solver.tolerance": (0.0, 0.01)}
RIGID = {"box", "icosahedron", "mesh"}
Axes = Mapping[str, Sequence[Any]]


class AxisError(ValueError):
    """An axis that cannot be read, or too many settings."""


def parse(arguments: Sequence[str]) -> dict[str, list[Any]]:
    """Axes from `PATH=VALUE,VALUE,...`, values being YAML. Raises AxisError."""
    axes: dict[str, list[Any]] = {}
    for argument in arguments:
        path, equals, text = argument.partition("=")
        try:
            source, wrong = compose(f"[{text}]", "--axis")
        except SceneError:
            source, wrong = None, []
        values = source.data if source and not wrong and equals and path and text.strip() else None
        if not isinstance(values, list) or not values:
            raise AxisError(f"--axis {argument}: write PATH=VALUE,VALUE, such as solver.substeps=4,8,16")
        axes[path] = values
    return axes


def grid(axes: Axes, most: int) -> list[dict[str, Any]]:
    """Every combination of the axes' values. Raises AxisError if there are more than `most`."""
    found = [dict(zip(axes, values, strict=True)) for values in product(*axes.values())]
    if len(found) > most:
        raise AxisError(f"the axes make {len(found)} settings, more than {most}; allow them with --runs")
    return found


def star(scene: Scene, most: int) -> list[dict[str, Any]]:
    """Substeps about the scene's own, under every other choice of the solver one at a time, and passes at the scene's substeps."""
    own = {path: value_of(scene, path) for path in CHOICES}
    steps, near = (sorted({max(1, round(factor * scene.solver.substeps)) for factor in some}) for some in (FACTORS, FACTORS[1:4]))
    found: list[dict[str, Any]] = [{"solver.substeps": k} for k in steps]
    found += [{"solver.substeps": scene.solver.substeps, "solver.iterations": scene.solver.iterations * n} for n in PASSES[1:]]
    for path, values in applicable(scene):
        found += [{"solver.substeps": k, path: value} for value in values if value != own[path] for k in near]
    return found[:most]


def applicable(scene: Scene) -> Iterator[tuple[str, tuple[Any, ...]]]:
    """Choices that make a difference to what the scene holds."""
    kinds = {body.kind for body in scene.bodies}
    for path, values in CHOICES.items():
        if path == "solver.order":
            useful = {"sequential": True, "constraint_graph": bool(kinds & RIGID), "lines": bool(kinds - RIGID)}
            values = tuple(value for value in values if useful[value])
        yield path, values


def same_particles(scene: Scene, other: Scene) -> bool:
    """Whether two scenes have the same particles at the same frames, so that they can be compared one by one."""
    return scene.time == other.time and list(map(particles_of, scene.bodies)) == list(map(particles_of, other.bodies))


def particles_of(body: Body) -> tuple[Any, ...]:
    """What the number of a body's particles hangs on."""
    return body.kind, body.count, body.particles, getattr(body, "file", None)


def value_of(scene: Scene, path: str) -> Any:
    """What a scene has at a path of two words."""
    part, key = path.split(".")
    return getattr(getattr(scene, part), key)
