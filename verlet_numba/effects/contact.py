"""Contact of particles with colliders (paper, 6.1): particles that penetrate are moved out along the surface's normal.

Once a substep, after integration, every particle near a collider becomes a contact: a plane through the surface that
it must not go below, from the particle's predicted place. Where the prediction lies inside, the plane is the one
that the particle met first, judged from its place at the start of the substep in the collider's own frame: fast
particles leave by the face through which they came. Before every relaxation pass the contacts are separated, with
the push accumulated over the passes: a pass may take back what an earlier one gave too much, never pull.
"""


from verlet_numba._jit import kernel
from verlet_numba.buffers import BOX, PLANE, SPHERE
from verlet_numba.physics.pose import inward, outward
from verlet_numba.physics.solids import box, cylinder, plane, sphere

BATCH = 128


@kernel
def surface(solids, s, x, y, z):
    """Signed distance from the surface of solid s [m] and the outward normal, in its own frame."""
    kind, extent = solids.kind[s], solids.extent
    if kind == PLANE:
        return plane(x, y, z, extent[0, s], extent[1, s], extent[2, s], extent[3, s])
    if kind == BOX:
        return box(x, y, z, extent[0, s], extent[1, s], extent[2, s])
    if kind == SPHERE:
        return sphere(x, y, z, extent[0, s])
    return cylinder(x, y, z, extent[0, s], extent[1, s])


@kernel
def find_contacts(particles, contact):
    """List the particles within the margin of a collider. False: more than there is room for (grow and call again)."""
    if contact is None:
        return True
    contact.listed[0] = 0
    solids, n = contact.solids, particles.inverse_mass.size
    for s in range(solids.kind.size):
        for first in range(0, n, BATCH):
            last = min(n, first + BATCH)
            if not any_near(particles.position[:, first:last], contact.radius[first:last], solids, s, contact.margin):
                continue
            for k in range(first, last):
                if particles.inverse_mass[k] > 0 and not list_contact(particles, contact, k, s):
                    return False
    return True


@kernel
def any_near(position, radius, solids, s, margin):
    """Whether any particle of a batch comes near solid s: below its plane, or within the sphere that holds it."""
    x, y, z = position[0], position[1], position[2]
    ox, oy, oz = solids.origin[0, s], solids.origin[1, s], solids.origin[2, s]
    near = 0
    if solids.kind[s] == PLANE:
        nx, ny, nz = outward(solids.extent[0, s], solids.extent[1, s], solids.extent[2, s], solids.rotation, s)
        bound = solids.extent[3, s] + margin + nx * ox + ny * oy + nz * oz
        for k in range(x.size):
            near += nx * x[k] + ny * y[k] + nz * z[k] < bound + radius[k]
    else:
        reach = solids.reach[s] + margin
        for k in range(x.size):
            dx, dy, dz, far = x[k] - ox, y[k] - oy, z[k] - oz, reach + radius[k]
            near += dx * dx + dy * dy + dz * dz < far * far
    return near > 0


@kernel
def list_contact(particles, contact, k, s):
    """Make a contact of particle k and solid s if they are near. False: no room."""
    solids, here, before = contact.solids, particles.position, particles.previous
    x, y, z = inward(here[0, k], here[1, k], here[2, k], solids.origin, solids.rotation, s)
    gap, nx, ny, nz = surface(solids, s, x, y, z)
    radius = contact.radius[k]
    if gap - radius >= contact.margin:
        return True
    c = contact.listed[0]
    if c == contact.particle.size:
        return False
    u, v, w = inward(before[0, k], before[1, k], before[2, k], solids.origin_before, solids.rotation_before, s)
    if gap < 0.0:
        start, mx, my, mz = surface(solids, s, u, v, w)
        if start > 0.0:  # came from outside: the plane through the surface point that it was nearest to
            nx, ny, nz = mx, my, mz
            gap = start + nx * (x - u) + ny * (y - v) + nz * (z - w)
    level = nx * x + ny * y + nz * z - gap + radius
    nx, ny, nz = outward(nx, ny, nz, solids.rotation, s)
    contact.listed[0] = c + 1
    contact.particle[c], contact.solid[c], contact.push[c] = k, s, 0.0
    contact.normal[0, c], contact.normal[1, c], contact.normal[2, c] = nx, ny, nz
    ox, oy, oz = solids.origin[0, s], solids.origin[1, s], solids.origin[2, s]
    contact.bound[c] = level + nx * ox + ny * oy + nz * oz
    u, v, w = outward(u, v, w, solids.rotation, s)
    contact.anchor[0, c], contact.anchor[1, c], contact.anchor[2, c] = u + ox, v + oy, w + oz
    return True


@kernel
def height(place, contact, c):
    """How far along contact c's normal `position` stands above its bound [m]; negative: penetration."""
    k = contact.particle[c]
    return (contact.normal[0, c] * place[0, k] + contact.normal[1, c] * place[1, k]
            + contact.normal[2, c] * place[2, k]) - contact.bound[c]


@kernel
def separate(position, contact):
    """Move every penetrating particle out to its plane; take back what an earlier pass of this substep gave too much."""
    if contact is None:
        return
    for c in range(contact.listed[0]):
        k, given = contact.particle[c], contact.push[c]
        if contact.body[k] >= 0:        # answers as a whole (effects/response.py)
            continue
        push = max(0.0, given - height(position, contact, c))
        if push != given:
            for axis in range(3):
                position[axis, k] += (push - given) * contact.normal[axis, c]
            contact.push[c] = push


@kernel
def penetration(position, inverse_mass, contact):
    """The deepest penetration of any particle [m] into any collider in its pose before this substep; 0 if none."""
    if contact is None:
        return 0.0
    solids, deepest = contact.solids, 0.0
    for s in range(solids.kind.size):
        for k in range(inverse_mass.size):
            if inverse_mass[k] > 0:
                x, y, z = inward(position[0, k], position[1, k], position[2, k], solids.origin_before, solids.rotation_before, s)
                gap = surface(solids, s, x, y, z)[0]
                deepest = max(deepest, contact.radius[k] - gap)
    return deepest


@kernel
def touching(contact):
    """The number of contacts that have pushed in this substep."""
    if contact is None:
        return 0
    pushed = 0
    for c in range(contact.listed[0]):
        pushed += contact.push[c] > 0.0
    return pushed
