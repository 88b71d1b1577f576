"""What moves on its own account: pinned particles and colliders along paths, colliders that spin."""

from verlet_numba._jit import kernel
from verlet_numba.physics.pose import turn


@kernel
def along(paths, m, time):
    """The point of path m at a time: piecewise linear, constant before the first and after the last knot."""
    first, last = paths.first[m], paths.first[m + 1] - 1
    knot, beyond = first, last + 1              # the last knot that is not later than `time`, by bisection
    while beyond - knot > 1:
        middle = (knot + beyond) // 2
        if paths.time[middle] <= time:
            knot = middle
        else:
            beyond = middle
    if knot == last or time <= paths.time[first]:
        return paths.point[0, knot], paths.point[1, knot], paths.point[2, knot]
    s = (time - paths.time[knot]) / (paths.time[knot + 1] - paths.time[knot])
    return (paths.point[0, knot] + s * (paths.point[0, knot + 1] - paths.point[0, knot]),
            paths.point[1, knot] + s * (paths.point[1, knot + 1] - paths.point[1, knot]),
            paths.point[2, knot] + s * (paths.point[2, knot + 1] - paths.point[2, knot]))


@kernel
def carry(position, time, carried):
    """Bring pinned particles to where their path is at `time` [s], carried by its displacement since its first knot."""
    if carried is None:
        return
    paths, shift, particle, path, start = carried.paths, carried.shift, carried.particle, carried.path, carried.start
    for m in range(shift.shape[1]):
        first, (x, y, z) = paths.first[m], along(paths, m, time)
        shift[0, m], shift[1, m], shift[2, m] = x - paths.point[0, first], y - paths.point[1, first], z - paths.point[2, first]
    for c in range(particle.size):
        for axis in range(3):
            position[axis, particle[c]] = start[axis, c] + shift[axis, path[c]]


@kernel
def move(contact, time, moving):
    """Bring colliders to their pose at `time` [s] and keep the pose before."""
    if moving is None:
        return
    solids = contact.solids
    for m in range(moving.collider.size):
        k = moving.collider[m]
        for axis in range(3):
            solids.origin_before[axis, k] = solids.origin[axis, k]
            for column in range(3):
                solids.rotation_before[axis, column, k] = solids.rotation[axis, column, k]
        point = along(moving.paths, m, time)
        solids.origin[0, k], solids.origin[1, k], solids.origin[2, k] = point[0], point[1], point[2]
        for column in range(3):
            axis = turn(moving.rotation[0, column, m], moving.rotation[1, column, m], moving.rotation[2, column, m],
                        moving.spin[0, m], moving.spin[1, m], moving.spin[2, m], time)
            solids.rotation[0, column, k], solids.rotation[1, column, k], solids.rotation[2, column, k] = axis
