"""Orientation guard: a rigid body that was squashed through itself comes back as itself, not as its mirror image.

Distances cannot tell a body from its mirror image: pressed flat, a cube of particles may open to the wrong side, and all its
sticks are content. So the volume of four of its particles keeps the sign that it has at rest. A body of the wrong sign has
just passed through a plane: it is reflected in the plane that it lies nearest to, through its centre, with its velocities,
as if its particles had bounced off that plane. Momentum and kinetic energy stay what they are.
"""

from verlet_numba._jit import kernel
from verlet_numba.physics.orientation import thinnest, volume


@kernel
def keep_orientation(position, previous, orientation):
    """Reflect the rigid bodies that are inside out."""
    if orientation is None:
        return
    x, y, z, u, v, w = position[0], position[1], position[2], previous[0], previous[1], previous[2]
    first, stride, size, corner, sign = orientation
    for b in range(first.size):
        i, j, k, m = corner[0, b], corner[1, b], corner[2, b], corner[3, b]
        found = volume(x[j] - x[i], y[j] - y[i], z[j] - z[i], x[k] - x[i], y[k] - y[i], z[k] - z[i],
                       x[m] - x[i], y[m] - y[i], z[m] - z[i])
        if found * sign[b] < 0.0:
            begin, end, by = first[b], first[b] + size[b] * stride[b], stride[b]
            nx, ny, nz = normal_of(x, y, z, begin, end, by, size[b])
            reflect(x, y, z, begin, end, by, size[b], nx, ny, nz)
            reflect(u, v, w, begin, end, by, size[b], nx, ny, nz)


@kernel
def normal_of(x, y, z, begin, end, by, size):
    """The direction in which these particles, of one mass, extend least about their centre."""
    cx, cy, cz = mean_of(x, begin, end, by, size), mean_of(y, begin, end, by, size), mean_of(z, begin, end, by, size)
    xx = yy = zz = xy = xz = yz = 0.0
    for k in range(begin, end, by):
        dx, dy, dz = x[k] - cx, y[k] - cy, z[k] - cz
        xx, yy, zz, xy, xz, yz = xx + dx * dx, yy + dy * dy, zz + dz * dz, xy + dx * dy, xz + dx * dz, yz + dy * dz
    return thinnest(xx, yy, zz, xy, xz, yz)


@kernel
def mean_of(row, begin, end, by, size):
    """Mean of a coordinate."""
    total = 0.0
    for k in range(begin, end, by):
        total += row[k]
    return total / size


@kernel
def reflect(x, y, z, begin, end, by, size, nx, ny, nz):
    """Reflect particles in the plane through their centre with the unit normal n."""
    cx, cy, cz = mean_of(x, begin, end, by, size), mean_of(y, begin, end, by, size), mean_of(z, begin, end, by, size)
    for k in range(begin, end, by):
        twice = 2.0 * (nx * (x[k] - cx) + ny * (y[k] - cy) + nz * (z[k] - cz))
        x[k] -= twice * nx
        y[k] -= twice * ny
        z[k] -= twice * nz
