"""Contact of particles with mesh colliders: a plane through the point of the surface that is nearest, as in effects/contact.py.

The particle is brought into the mesh's frame, where a tree of boxes finds the nearest point c of all triangles. The sign of
p - c along the normal of the feature that c lies on tells the side (Baerentzen & Aanaes 2005): of a closed mesh, whether p
is inside. A sheet is met from the side on which the particle was: that of the last substep while it is near, else that of
its place at the start of the substep. At the sheet's border a particle may pass from one side to the other.
"""

import math

from verlet_numba._jit import kernel
from verlet_numba.buffers.arrays import NO_ROOM
from verlet_numba.buffers.contact import MESH
from verlet_numba.effects.contact import pose_of
from verlet_numba.kernels.internal_edges import feature
from verlet_numba.physics.closest import length, on_triangle
from verlet_numba.physics.pose import inward, outward

ON = 1e-9               # of the mesh's reach: a point as near to the surface takes its normal from the feature


@kernel
def find_mesh_contacts(position, previous, inverse_mass, contact, meshes):
    """List the particles within the margin of a mesh. False: no room."""
    if meshes is None:
        return True
    for s in range(contact.solids.kind.size):
        if contact.solids.kind[s] == MESH and not list_of_mesh(position, previous, inverse_mass, contact, meshes, s):
            return False
    return True


@kernel
def list_of_mesh(position, previous, inverse_mass, contact, meshes, s):
    """List the contacts of mesh s: of particles that may have met the sphere that holds it in this substep. False: no room."""
    solids, radii, within, room = contact.solids, contact.radius, contact.within, contact.particle.size
    pose, earlier = pose_of(solids.origin, solids.rotation, s), pose_of(solids.origin_before, solids.rotation_before, s)
    particle, solid, push, as_hull, reach = contact.particle, contact.solid, contact.push, contact.planes_only, solids.reach[s]
    normal, bound, anchor, side = contact.normal, contact.bound, contact.anchor, meshes.side[s]
    x, y, z, u, v, w = position[0], position[1], position[2], previous[0], previous[1], previous[2]
    c = contact.listed[0]
    for k in range(inverse_mass.size):
        if as_hull[k] or not inverse_mass[k] > 0:
            continue
        px, py, pz = inward(x[k], y[k], z[k], pose)
        qx, qy, qz = inward(u[k], v[k], w[k], earlier)
        step, far = length(px - qx, py - qy, pz - qz), within[k]
        if length(px, py, pz) >= reach + far + step:
            side[k] = 0
            continue
        gap, nx, ny, nz, turn = meet_mesh(meshes, s, ON * reach, far + step, side[k], px, py, pz, qx, qy, qz)
        side[k] = turn
        if gap >= far:
            continue
        if c == room:
            contact.listed[0] = NO_ROOM
            return False
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
def meet_mesh(meshes, s, on, reach, known, px, py, pz, qx, qy, qz):
    """Gap and normal of mesh s at p, come from q, and the side (1 front, -1 behind) from which it is met.

    What passed through the surface meets the plane through the surface point nearest to q. Where p is not near the gap is
    infinite and the side 0. known: the side that is remembered of the particle (Meshes.side).
    reach: how far from p and q to look; p - q included, since what has crossed the surface is no farther from it.
    """
    gap, nx, ny, nz, border = distance(meshes, s, on, reach, px, py, pz)
    if gap == math.inf:
        return gap, nx, ny, nz, 0
    turn = 1
    if not meshes.closed[s]:
        if border:
            turn = -1 if gap < 0.0 else 1
        elif known != 0:
            turn = known
        else:
            start, _, _, _, free = distance(meshes, s, on, reach, qx, qy, qz)
            turn = -1 if (gap if free or start == math.inf else start) < 0.0 else 1
    if turn * gap < 0.0:
        start, mx, my, mz, _ = distance(meshes, s, on, reach, qx, qy, qz)
        if turn * start > 0.0 and start != math.inf:
            gap, nx, ny, nz = start + mx * (px - qx) + my * (py - qy) + mz * (pz - qz), mx, my, mz
    return turn * gap, turn * nx, turn * ny, turn * nz, turn


@kernel
def distance(meshes, s, on, reach, x, y, z):
    """Signed distance [m] from mesh s in its frame, its gradient, and whether the nearest point is on the border.

    Negative behind the surface; infinite where nothing is nearer than `reach`.
    """
    skip, triangle, box, corner, normal = meshes.skip, meshes.triangle, meshes.box, meshes.corner, meshes.normal
    found, best, wa, wb, wc = -1, reach * reach, 0.0, 0.0, 0.0
    k, end = meshes.first[s], meshes.first[s + 1]
    while k < end:
        dx, dy, dz = (max(box[k, 0] - x, x - box[k, 3], 0.0), max(box[k, 1] - y, y - box[k, 4], 0.0),
                      max(box[k, 2] - z, z - box[k, 5], 0.0))
        if dx * dx + dy * dy + dz * dz >= best:
            k = skip[k]
            continue
        t = triangle[k]
        if t >= 0:
            a, b, c, squared = on_triangle(x, y, z, corner[t, 0], corner[t, 1], corner[t, 2], corner[t, 3], corner[t, 4],
                                           corner[t, 5], corner[t, 6], corner[t, 7], corner[t, 8])
            if squared < best:
                found, best, wa, wb, wc = t, squared, a, b, c
        k += 1
    if found < 0:
        return math.inf, 0.0, 0.0, 1.0, False
    t, f = found, feature(wa > 0.0, wb > 0.0, wc > 0.0)
    dx = x - (wa * corner[t, 0] + wb * corner[t, 3] + wc * corner[t, 6])
    dy = y - (wa * corner[t, 1] + wb * corner[t, 4] + wc * corner[t, 7])
    dz = z - (wa * corner[t, 2] + wb * corner[t, 5] + wc * corner[t, 8])
    nx, ny, nz = normal[t, 3 * f], normal[t, 3 * f + 1], normal[t, 3 * f + 2]
    sign = -1.0 if nx * dx + ny * dy + nz * dz < 0.0 else 1.0
    apart = math.sqrt(best)
    if f > 0 and apart > on:
        nx, ny, nz = sign * dx / apart, sign * dy / apart, sign * dz / apart
    return sign * apart, nx, ny, nz, meshes.border[t, f] > 0


@kernel
def deepest_in_meshes(position, inverse_mass, contact, meshes):
    """The deepest penetration of any particle [m] into a mesh in its pose before this substep; 0 if none."""
    if meshes is None:
        return 0.0
    solids, radii, as_hull, deepest = contact.solids, contact.radius, contact.planes_only, 0.0
    x, y, z = position[0], position[1], position[2]
    for s in range(solids.kind.size):
        if solids.kind[s] != MESH:
            continue
        pose, reach, side = pose_of(solids.origin_before, solids.rotation_before, s), solids.reach[s], meshes.side[s]
        for k in range(inverse_mass.size):
            if as_hull[k] or not inverse_mass[k] > 0:
                continue
            px, py, pz = inward(x[k], y[k], z[k], pose)
            far = reach + radii[k]
            if length(px, py, pz) > far:
                continue
            gap, _, _, _, border = distance(meshes, s, ON * reach, 2.0 * far, px, py, pz)
            if not meshes.closed[s]:
                gap = abs(gap) if border or side[k] == 0 else side[k] * gap
            deepest = max(deepest, radii[k] - gap)
    return deepest
