"""Contact of particles with colliders (paper, 6.1): particles that penetrate are moved out along the surface's normal.

Once a substep, after integration, every particle near a collider becomes a contact: a plane through the surface that
it must not go below, from the particle's predicted place. Where the prediction lies inside, the plane is the one
that the particle met first, judged from its place at the start of the substep in the collider's own frame: fast
particles leave by the face through which they came. Before every relaxation pass the contacts are separated, with
the push accumulated over the passes: a pass may take back what an earlier one gave too much, never pull.
"""

from verlet_numba._jit import formula, inlined, kernel
from verlet_numba.buffers.arrays import NO_ROOM
from verlet_numba.buffers.contact import BOX, MESH, PLANE, SPHERE
from verlet_numba.buffers.world import COLUMNS, PENETRATION
from verlet_numba.physics.pose import inward, outward
from verlet_numba.physics.solids import box, cylinder, plane, sphere


@formula
def surface(kind, extent, x, y, z):
    """Signed distance from the surface of a solid [m] and the outward normal, in its own frame."""
    if kind == PLANE:
        return plane(x, y, z, extent[0], extent[1], extent[2], extent[3])
    if kind == BOX:
        return box(x, y, z, extent[0], extent[1], extent[2])
    if kind == SPHERE:
        return sphere(x, y, z, extent[0])
    return cylinder(x, y, z, extent[0], extent[1])


@inlined
def pose_of(origin, rotation, s):
    """The pose of solid s."""
    return (origin[0, s], origin[1, s], origin[2, s],
            rotation[0, 0, s], rotation[0, 1, s], rotation[0, 2, s],
            rotation[1, 0, s], rotation[1, 1, s], rotation[1, 2, s],
            rotation[2, 0, s], rotation[2, 1, s], rotation[2, 2, s])


@inlined
def extent_of(extent, s):
    """The extent of solid s."""
    return extent[0, s], extent[1, s], extent[2, s], extent[3, s]


@kernel
def find_contacts(position, previous, inverse_mass, contact):
    """List the particles within the margin of a collider, meshes apart. False: no room (grow and call again)."""
    if contact is None:
        return True
    contact.listed[0] = 0
    fits = True
    for s in range(contact.solids.kind.size):
        if contact.solids.kind[s] != MESH:
            fits = fits and list_contacts(position, previous, inverse_mass, contact, s)
    return fits


@kernel
def list_contacts(position, previous, inverse_mass, contact, s):
    """List the contacts of solid s: batch by batch of particles, first those that a coarse test finds near. False: no room."""
    solids, radii, within, room = contact.solids, contact.radius, contact.within, contact.particle.size
    kind, extent, reach = solids.kind[s], extent_of(solids.extent, s), solids.reach[s]
    pose, earlier = pose_of(solids.origin, solids.rotation, s), pose_of(solids.origin_before, solids.rotation_before, s)
    particle, solid, push, planes_only, near = contact.particle, contact.solid, contact.push, contact.planes_only, contact.near
    normal, bound, anchor = contact.normal, contact.bound, contact.anchor
    x, y, z, u, v, w = position[0], position[1], position[2], previous[0], previous[1], previous[2]
    c = contact.listed[0]
    for first in range(0, inverse_mass.size, near.size):
        last = min(inverse_mass.size, first + near.size)
        if not any_near(x[first:last], y[first:last], z[first:last], within[first:last], kind, extent, pose, reach, near):
            continue
        for k in range(first, last):
            if not near[k - first] or not inverse_mass[k] > 0 or (planes_only[k] and kind != PLANE):
                continue
            px, py, pz = inward(x[k], y[k], z[k], pose)
            gap, nx, ny, nz = surface(kind, extent, px, py, pz)
            if gap >= within[k]:
                continue
            if c == room:
                contact.listed[0] = NO_ROOM
                return False
            qx, qy, qz = inward(u[k], v[k], w[k], earlier)
            gap, nx, ny, nz = entered(kind, extent, px, py, pz, qx, qy, qz, gap, nx, ny, nz)
            level = nx * px + ny * py + nz * pz - gap + radii[k]
            nx, ny, nz = outward(nx, ny, nz, pose)
            qx, qy, qz = outward(qx, qy, qz, pose)
            particle[c], solid[c], push[c] = k, s, 0.0
            normal[0, c], normal[1, c], normal[2, c] = nx, ny, nz
            bound[c] = level + nx * pose[0] + ny * pose[1] + nz * pose[2]
            anchor[0, c], anchor[1, c], anchor[2, c] = qx + pose[0], qy + pose[1], qz + pose[2]
            c += 1
    contact.listed[0] = c
    return True


@kernel
def any_near(x, y, z, within, kind, extent, pose, reach, near):
    """Mark the particles of a batch that come near a solid: below its plane, or within the sphere that holds it."""
    found = 0
    if kind == PLANE:
        nx, ny, nz = outward(extent[0], extent[1], extent[2], pose)
        bound = extent[3] + nx * pose[0] + ny * pose[1] + nz * pose[2]
        for k in range(x.size):
            near[k] = nx * x[k] + ny * y[k] + nz * z[k] < bound + within[k]
            found += near[k]
    else:
        for k in range(x.size):
            dx, dy, dz, far = x[k] - pose[0], y[k] - pose[1], z[k] - pose[2], reach + within[k]
            near[k] = dx * dx + dy * dy + dz * dz < far * far
            found += near[k]
    return found > 0


@formula
def entered(kind, extent, px, py, pz, qx, qy, qz, gap, nx, ny, nz):
    """Gap and normal at p; inside, but come from q outside: those of the plane through the surface point nearest to q."""
    if gap < 0.0:
        start, mx, my, mz = surface(kind, extent, qx, qy, qz)
        if start > 0.0:
            return start + mx * (px - qx) + my * (py - qy) + mz * (pz - qz), mx, my, mz
    return gap, nx, ny, nz


@formula
def risen(normal, c, x, y, z):
    """The vector (x, y, z) along the normal of contact c [m]."""
    return normal[0, c] * x + normal[1, c] * y + normal[2, c] * z


@kernel
def separate(position, contact):
    """Move every penetrating particle out to its plane; take back what an earlier pass of this substep gave too much."""
    if contact is None:
        return
    particle, body, push = contact.particle, contact.body, contact.push
    normal, bound = contact.normal, contact.bound
    x, y, z = position[0], position[1], position[2]
    for c in range(contact.listed[0]):
        k, given = particle[c], push[c]
        if body[k] >= 0:        # answers as a whole (effects/response.py)
            continue
        total = max(0.0, given - (risen(normal, c, x[k], y[k], z[k]) - bound[c]))
        if total != given:
            push[c] = total
            x[k] += (total - given) * normal[0, c]
            y[k] += (total - given) * normal[1, c]
            z[k] += (total - given) * normal[2, c]


@kernel
def penetration(measures, position, inverse_mass, contact, instances):
    """Raise every instance's measure to the deepest penetration [m] of its particles into any collider but meshes.

    Colliders are in their poses before this substep. As contacts are listed: batch by batch, and only what a coarse test finds
    near is looked at.
    """
    if contact is None:
        return
    solids, radii, within, planes_only, near = contact.solids, contact.radius, contact.within, contact.planes_only, contact.near
    x, y, z = position[0], position[1], position[2]
    for s in range(solids.kind.size):
        kind, extent, reach = solids.kind[s], extent_of(solids.extent, s), solids.reach[s]
        if kind == MESH:
            continue
        pose = pose_of(solids.origin_before, solids.rotation_before, s)
        for first in range(0, inverse_mass.size, near.size):
            last = min(inverse_mass.size, first + near.size)
            if not any_near(x[first:last], y[first:last], z[first:last], within[first:last], kind, extent, pose, reach, near):
                continue
            for k in range(first, last):
                if near[k - first] and inverse_mass[k] > 0 and not (planes_only[k] and kind != PLANE):
                    px, py, pz = inward(x[k], y[k], z[k], pose)
                    place = instance(k, instances) * COLUMNS + PENETRATION
                    measures[place] = max(measures[place], radii[k] - surface(kind, extent, px, py, pz)[0])


@inlined
def instance(k, instances):
    """The instance that particle k is of. A division takes as long as a tenth of a contact: one alone does without."""
    return 0 if instances == 1 else k % instances


@kernel
def touching(contact, pushed):
    """Count to each instance the contacts that have pushed in this substep; those of bodies that answer as a whole are touches."""
    if contact is None:
        return
    particle, body, push = contact.particle, contact.body, contact.push
    for c in range(contact.listed[0]):
        if body[particle[c]] < 0 and push[c] > 0.0:
            pushed[instance(particle[c], pushed.size)] += 1
