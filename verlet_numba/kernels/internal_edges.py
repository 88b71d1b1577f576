"""Contacts of hulls with the triangles of a mesh: normals that the surface around the triangle does not allow are replaced.

Each triangle meets a body on its own, so the narrow phase may find a side of it nearest where the surface goes on: a body
that slides over a flat floor would catch on the sides within (internal edges). A normal n at a point q of a mesh is one
of the surface if the surface around q lies behind the plane through q across n: then no other triangle there is nearer.
All corners of the triangles that share q's face, side or corner tell: n . (x - q) <= 0. Otherwise, and where n points
out of the back, the contact gets the normal of that triangle around q that is the nearest to n. Its plane bounds the free
space near q: at a flat or concave side the surface does not fall below it.

The front of a closed mesh is outside. A sheet, a mesh with a border, is met from the side on which the body's hull has its
centre; at the border itself every normal with the sheet behind it will do.
"""

import math

from verlet_numba._jit import formula, inlined, kernel
from verlet_numba.physics.closest import on_triangle
from verlet_numba.physics.rigid import cross

BEHIND = 1e-7           # sine of the angle by which the surface may rise over the plane behind it
CARRIED = 1e-9          # weight of a corner below which a contact is not on it
INSTANCES = 1e-6           # of the distance from the triangle: a point that is no farther aside is above it


@kernel
def straighten(hulls, pairs, meetings, ridges):
    """Replace the normals of contacts with triangles that the surface around does not allow, with point and gap."""
    if ridges is None:
        return
    x, y, z, start, size, rounding, centre = (hulls.corner[0], hulls.corner[1], hulls.corner[2], hulls.start, hulls.size,
                                              hulls.rounding, hulls.centre)
    one, other, pair, corner, weight = pairs.first, pairs.second, meetings.pair, meetings.corner, meetings.weight
    normal, gap = meetings.normal, meetings.gap
    triangle, closed, border, first, around = ridges.triangle, ridges.closed, ridges.border, ridges.start, ridges.around
    for m in range(meetings.listed[0]):
        g, h = one[pair[m]], other[pair[m]]         # bodies come before colliders
        t = triangle[h]
        if t < 0:
            continue
        b = start[h]
        f = 7 * t + carrier(corner, weight, b, m)
        nx, ny, nz = normal[0, m], normal[1, m], normal[2, m]
        px, py, pz = weighted(x, y, z, corner, weight, 0, m)
        qx, qy, qz = weighted(x, y, z, corner, weight, 3, m)
        fx, fy, fz = face_normal(x, y, z, b)
        side = 1.0
        if not closed[t] and (fx * (centre[0, g] - qx) + fy * (centre[1, g] - qy) + fz * (centre[2, g] - qz)) < 0.0:
            side = -1.0
        allowed, up, nearest, best = True, 0.0, h, -math.inf
        for i in range(first[f], first[f + 1]):
            c = start[around[i]]
            for k in range(c, c + 3):
                allowed = allowed and not rises(nx, ny, nz, x[k] - qx, y[k] - qy, z[k] - qz)
            ux, uy, uz = face_normal(x, y, z, c)
            along = side * (ux * nx + uy * ny + uz * nz)
            up += along
            if along > best:
                nearest, best = around[i], along
        if allowed and (up > 0.0 or border[f]):
            continue
        ux, uy, uz = face_normal(x, y, z, start[nearest])
        ux, uy, uz = side * ux, side * uy, side * uz
        if nearest == h:
            k = lowest(x, y, z, start[g], size[g], ux, uy, uz)
            wa, wb, wc, squared = on_triangle(x[k], y[k], z[k], x[b], y[b], z[b], x[b + 1], y[b + 1], z[b + 1],
                                              x[b + 2], y[b + 2], z[b + 2])
            height = ux * (x[k] - x[b]) + uy * (y[k] - y[b]) + uz * (z[k] - z[b])
            if best < 0.0 or squared - height * height <= INSTANCES * INSTANCES * squared:
                corner[0, m], corner[1, m], corner[2, m], corner[3, m], corner[4, m], corner[5, m] = k, k, k, b, b + 1, b + 2
                weight[0, m], weight[1, m], weight[2, m] = 1.0, 0.0, 0.0
                weight[3, m], weight[4, m], weight[5, m] = wa, wb, wc
                px, py, pz = x[k], y[k], z[k]
                qx, qy, qz = weighted(x, y, z, corner, weight, 3, m)
        normal[0, m], normal[1, m], normal[2, m] = ux, uy, uz
        gap[m] = ux * (px - qx) + uy * (py - qy) + uz * (pz - qz) - rounding[g] - rounding[h]


@formula
def rises(nx, ny, nz, dx, dy, dz):
    """Whether the vector d rises along the unit vector n."""
    rise = nx * dx + ny * dy + nz * dz
    return rise > 0.0 and rise * rise > BEHIND * BEHIND * (dx * dx + dy * dy + dz * dz)


@inlined
def carrier(corner, weight, begin, m):
    """The feature of the triangle with columns from `begin` on that the second point of contact m lies on."""
    a = b = c = 0.0
    for row in range(3, 6):
        k = corner[row, m] - begin
        a += weight[row, m] if k == 0 or k == 3 else 0.0        # the fourth column repeats the first
        b += weight[row, m] if k == 1 else 0.0
        c += weight[row, m] if k == 2 else 0.0
    return feature(a > CARRIED, b > CARRIED, c > CARRIED)


@formula
def feature(a, b, c):
    """The feature of a triangle that these corners carry: 0 its face, 1 to 3 a side, 4 to 6 a corner."""
    if a and b:
        return 0 if c else 1
    if c:
        if b:
            return 2
        return 3 if a else 6
    return 4 if a else 5


@inlined
def weighted(x, y, z, corner, weight, row, m):
    """The point of contact m on the first hull (row 0) or the second (row 3)."""
    i, j, k, a, b, c = (corner[row, m], corner[row + 1, m], corner[row + 2, m],
                        weight[row, m], weight[row + 1, m], weight[row + 2, m])
    return a * x[i] + b * x[j] + c * x[k], a * y[i] + b * y[j] + c * y[k], a * z[i] + b * z[j] + c * z[k]


@inlined
def face_normal(x, y, z, c):
    """The unit normal of the triangle with columns from c on."""
    nx, ny, nz = cross(x[c + 1] - x[c], y[c + 1] - y[c], z[c + 1] - z[c], x[c + 2] - x[c], y[c + 2] - y[c], z[c + 2] - z[c])
    length = math.sqrt(nx * nx + ny * ny + nz * nz)
    return nx / length, ny / length, nz / length


@inlined
def lowest(x, y, z, begin, corners, nx, ny, nz):
    """The column of a hull's corner that lies lowest along n."""
    found, least = begin, math.inf
    for k in range(begin, begin + corners):
        height = nx * x[k] + ny * y[k] + nz * z[k]
        if height < least:
            found, least = k, height
    return found
