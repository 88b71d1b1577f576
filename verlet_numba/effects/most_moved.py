"""Which particle of a rigid body a collision has moved most: its list orders the body's relaxation (paper, 6.2)."""

from verlet_numba._jit import kernel
from verlet_numba.kernels.copying import copy_points
from verlet_numba.kernels.relax_graph import sort_bodies


@kernel
def note_places(position, collided):
    """Where the particles are before they are separated."""
    if collided is None:
        return
    copy_points(position, collided.before)


@kernel
def choose_lists(position, collided, graph):
    """Sort the rigid bodies by the particle that separation has moved farthest since; those it left alone are untouched."""
    if collided is None:
        return
    x, y, z, u, v, w = position[0], position[1], position[2], collided.before[0], collided.before[1], collided.before[2]
    first, bucket, stride, particles, moved = graph.body[0], graph.bucket, graph.stride, graph.particles, collided.moved
    for b in range(first.size):
        f, most = graph.family[bucket[b]], 0.0
        moved[b] = -1
        for p in range(particles[f]):
            k = first[b] + p * stride[f]
            dx, dy, dz = x[k] - u[k], y[k] - v[k], z[k] - w[k]
            way = dx * dx + dy * dy + dz * dz
            if way > most:
                moved[b], most = p, way
    sort_bodies(graph, moved)
