"""The paper's experiments as scenes of any size, and what their positions tell: `python bench/experiments.py 1000`.

Printed is the scene of E1 with so many icosahedra. What is measured of positions knows nothing of the simulator: it sees
points and triangles.
"""

import copy
import math
from pathlib import Path
from typing import Any

import click
import numpy as np
import yaml
from cases import prepared
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from timing import computed

from verlet_numba.frame import OK
from verlet_numba.run.engine import run_chunk, start, warm
from verlet_numba.scene.build import Model, build, frames
from verlet_numba.scene.load import load
from verlet_numba.scene.shapes import edges

RESULTS = Path(__file__).parent / "results"
SCENES = Path(__file__).parents[1] / "scenes" / "paper"
FILL = 0.1                                                              # of the room, by icosahedra
VOLUME = 5 * (3 + math.sqrt(5)) / 12 / math.sin(2 * math.pi / 5) ** 3   # of an icosahedron of radius 1
CHUNK = 100                                                             # pairs of hulls looked at together
Array = NDArray[Any]
Scene = dict[str, Any]


def scene_of(name: str, solver: Scene) -> Scene:
    """A scene of the paper as plain data. solver {}: the scene's own."""
    scene = copy.deepcopy(load(SCENES / name).source.data)
    return scene | ({"solver": solver} if solver else {}) | {"expect": []}


def e1(count: int, **solver: Any) -> Scene:
    """So many icosahedra thrown into a room of which they fill a tenth."""
    scene = scene_of("icosahedra_room.yaml", solver)
    body, room = scene["bodies"][0], scene["colliders"][0]
    side = (count * VOLUME * body["radius"] ** 3 / FILL) ** (1 / 3)
    body["count"], body["scatter"]["inside"] = count, [[-side / 2] * 3, [side / 2] * 3]
    room["size"] = [side] * 3
    return scene


def e2(obstacle: str, side: int, **solver: Any) -> Scene:
    """A cloth of side x side particles falls on the cube or the rope. Its spheres leave no hole."""
    scene = scene_of(f"cloth_on_{obstacle}.yaml", solver)
    sheet = scene["bodies"][-1]
    sheet["resolution"], sheet["thickness"] = [side, side], 0.98 * sheet["size"][0] / (side - 1)
    return scene


def started(scene: Scene, warmed: bool = True) -> Model:
    """The scene at time 0; `warmed`: everything that its run needs is compiled."""
    ready = prepared(scene)
    if warmed:
        warm(start(build(ready.scene, ready.bodies)))
    return start(build(ready.scene, ready.bodies))


def advanced(model: Model, count: int) -> tuple[Array, float]:
    """The next frames (count, N, 3), and the processor seconds that they took. Raises ArithmeticError where they diverge."""
    chunk, status = frames(model, count), []
    seconds = computed(lambda: status.append(run_chunk(model, chunk)))
    if status != [OK] or not np.isfinite(chunk.position).all():
        raise ArithmeticError(f"diverged: {model.scene.name}, {model.scene.solver}")
    return chunk.position, seconds


def bodies_of(model: Model, positions: Array, body: int = 0) -> Array:
    """Positions (..., K, P, 3) of the copies of a body of the scene in double precision, from those of the file (..., N, 3)."""
    sizes = [each.copies * len(each.shape.positions) for each in model.bodies]
    first, chosen = sum(sizes[:body]), model.bodies[body]
    own = positions[..., first:first + sizes[body], :]
    return np.asarray(own, float).reshape(*positions.shape[:-2], chosen.copies, -1, 3)


def deepest_pair(bodies: Array, triangles: Array) -> float:
    """The deepest penetration [m] of two of the convex bodies (K, P, 3) with these triangles (F, 3); 0 if none touch.

    Two convex polyhedra overlap by the least overlap of their shadows on the axes that can part them: the normals of
    their faces, and the cross products of an edge of one and an edge of the other (separating axes; Gottschalk 1996). Any
    axis bounds the depth from above, so that of bodies out of shape is never told too small.
    """
    centres = bodies.mean(axis=1)
    reach = np.linalg.norm(bodies - centres[:, None], axis=2).max()
    pairs = cKDTree(centres).query_pairs(2 * reach, output_type="ndarray")
    deepest = 0.0
    for first in range(0, len(pairs), CHUNK):
        a, b = bodies[pairs[first:first + CHUNK, 0]], bodies[pairs[first:first + CHUNK, 1]]
        deepest = max(deepest, float(overlaps(a, b, triangles).max()))
    return deepest


def overlaps(a: Array, b: Array, triangles: Array) -> Array:
    """How deeply each body of a (M, P, 3) penetrates that of b; negative where they are apart."""
    joins = edges(triangles)
    u, v = (each[:, joins[:, 1]] - each[:, joins[:, 0]] for each in (a, b))
    across = np.cross(u[:, :, None], v[:, None]).reshape(len(a), -1, 3)
    normals = [np.cross(each[:, triangles[:, 1]] - each[:, triangles[:, 0]], each[:, triangles[:, 2]] - each[:, triangles[:, 0]])
               for each in (a, b)]
    axes = np.concatenate([*normals, across], axis=1)
    length = np.linalg.norm(axes, axis=2)
    parallel = length <= 1e-6 * length.max(axis=1, keepdims=True)
    axes /= np.where(parallel, 1.0, length)[..., None]
    on_a, on_b = axes @ a.swapaxes(1, 2), axes @ b.swapaxes(1, 2)
    shared = np.minimum(on_a.max(axis=2) - on_b.min(axis=2), on_b.max(axis=2) - on_a.min(axis=2))
    return np.asarray(np.where(parallel, np.inf, shared).min(axis=1))


def mirrored(bodies: Array, triangles: Array) -> int:
    """How many closed bodies (K, P, 3) are turned inside out: their volume is negative."""
    corners = (bodies - bodies.mean(axis=1, keepdims=True))[:, triangles]
    return int((np.linalg.det(corners).sum(axis=1) <= 0).sum())


def inside(bodies: Array, side: float) -> int:
    """How many bodies (K, P, 3) have their centre in the room about the origin."""
    return int((np.abs(bodies.mean(axis=1)) <= side / 2).all(axis=1).sum())


def beyond(bodies: Array, side: float) -> float:
    """How far any particle (..., 3) is outside of the room [m]; 0 if none is."""
    return max(0.0, float(np.abs(bodies).max()) - side / 2)


def strain(cloth: Array, spacing: float) -> float:
    """Mean relative length error of the sticks along the rows and columns of a cloth (nx, ny, 3)."""
    lengths = [np.linalg.norm(np.diff(cloth, axis=axis), axis=2).ravel() for axis in (0, 1)]
    return float(np.abs(np.concatenate(lengths) / spacing - 1).mean())


def depth_in_box(points: Array, radius: float, centre: Array, size: Array) -> float:
    """How deeply spheres about points (N, 3) are in a box [m]; 0 if none is."""
    past = np.abs(points - centre) - np.asarray(size) / 2
    distance = np.linalg.norm(np.maximum(past, 0), axis=1) + np.minimum(past.max(axis=1), 0)
    return max(0.0, radius - float(distance.min()))


def depth_in_spheres(points: Array, others: Array, reach: float) -> float:
    """How deeply spheres about points (N, 3) are in those about others (M, 3) [m], `reach` the sum of their radii."""
    return max(0.0, reach - float(cKDTree(others).query(points)[0].min()))


def depth_in_itself(points: Array, rest: Array, diameter: float) -> float:
    """How deeply spheres about points (N, 3) overlap that do not at `rest` (N, 3) [m]; 0 if none do."""
    pairs = cKDTree(points).query_pairs(diameter, output_type="ndarray")
    now, then = (np.linalg.norm(each[pairs[:, 1]] - each[pairs[:, 0]], axis=1) for each in (points, rest))
    return float((diameter - now)[then >= diameter].max(initial=0.0))


@click.command()
@click.argument("count", type=click.IntRange(1, 100_000))
def main(count: int) -> None:
    """Print the scene of E1 with COUNT icosahedra."""
    click.echo(yaml.safe_dump(e1(count), sort_keys=False, default_flow_style=None, width=120), nl=False)


if __name__ == "__main__":
    main()
