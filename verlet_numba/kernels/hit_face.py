"""Hit face: the face nearest the origin of the difference A - B of two convex hulls that meet (paper, 5.1).

The simplex that GJK ends with is inflated to a tetrahedron, and this polytope expanded (van den Bergen 2003, section 4.3.8):
the vertex farthest beyond the nearest face replaces all faces that it sees, until a nearest face has nothing beyond it.
The distance of a face has a sign, so the polytope need not hold the origin to begin with: where the origin is outside of
the difference, the result is the face whose plane separates the hulls most.

A difference without volume (flat bodies in one plane, crossing rods, two points) has its simplex itself for a hit face.
"""

import numpy as np

from verlet_numba._jit import formula, kernel
from verlet_numba.kernels.gjk import keep, known
from verlet_numba.kernels.support import support
from verlet_numba.physics.simplex import areas, cross, dot, side

POINT, LINE, PLANE, SOLID = 1, 2, 3, 4      # what the difference is: so many vertices span it


@formula
def square_across(ux, uy, uz):
    """A vector across u, along the plane of the two other axes: the least of u is left out."""
    if abs(ux) <= abs(uy) and abs(ux) <= abs(uz):
        return 0.0, uz, -uy
    if abs(uy) <= abs(uz):
        return -uz, 0.0, ux
    return uy, -ux, 0.0


@formula
def trial(vertex, n, t):
    """Number t of the directions in which n vertices may grow by one more; number 0 after the last."""
    if n == 1:
        s = 1.0 if t % 2 == 0 else -1.0
        return (s if t // 2 == 0 else 0.0), (s if t // 2 == 1 else 0.0), (s if t // 2 == 2 else 0.0)
    ux, uy, uz = vertex[0, 1] - vertex[0, 0], vertex[1, 1] - vertex[1, 0], vertex[2, 1] - vertex[2, 0]
    if n == 2:
        wx, wy, wz = square_across(ux, uy, uz)
        if t >= 2:
            wx, wy, wz = cross(ux, uy, uz, wx, wy, wz)
    else:
        wx, wy, wz = vertex[0, 2] - vertex[0, 0], vertex[1, 2] - vertex[1, 0], vertex[2, 2] - vertex[2, 0]
        wx, wy, wz = cross(ux, uy, uz, wx, wy, wz)
    if t % 2 == 0:
        return wx, wy, wz
    return -wx, -wy, -wz


@formula
def height(vertex, n):
    """How far [m] vertex n lies from what the n vertices before it span."""
    px, py, pz = vertex[0, n] - vertex[0, 0], vertex[1, n] - vertex[1, 0], vertex[2, n] - vertex[2, 0]
    if n == 1:
        return np.sqrt(dot(px, py, pz, px, py, pz))
    ux, uy, uz = vertex[0, 1] - vertex[0, 0], vertex[1, 1] - vertex[1, 0], vertex[2, 1] - vertex[2, 0]
    if n == 2:
        wx, wy, wz = cross(ux, uy, uz, px, py, pz)
        return np.sqrt(dot(wx, wy, wz, wx, wy, wz) / dot(ux, uy, uz, ux, uy, uz))
    wx, wy, wz = cross(ux, uy, uz, vertex[0, 2] - vertex[0, 0], vertex[1, 2] - vertex[1, 0], vertex[2, 2] - vertex[2, 0])
    return abs(dot(wx, wy, wz, px, py, pz)) / np.sqrt(dot(wx, wy, wz, wx, wy, wz))


@formula
def spacious(vertex, noise):
    """Whether the first four vertices span a volume: that of the parallelepiped, over the square of its longest edge, is no
    more than any of the heights. No root and no division, for the common case.
    """
    px, py, pz = vertex[0, 0], vertex[1, 0], vertex[2, 0]
    ux, uy, uz, vx, vy, vz, wx, wy, wz = (vertex[0, 1] - px, vertex[1, 1] - py, vertex[2, 1] - pz,
                                          vertex[0, 2] - px, vertex[1, 2] - py, vertex[2, 2] - pz,
                                          vertex[0, 3] - px, vertex[1, 3] - py, vertex[2, 3] - pz)
    longest = max(max(dot(ux, uy, uz, ux, uy, uz), dot(vx, vy, vz, vx, vy, vz)), dot(wx, wy, wz, wx, wy, wz))
    return abs(dot(*cross(ux, uy, uz, vx, vy, vz), wx, wy, wz)) > noise * longest


@formula
def drop_flat(vertex, label, weight, n, noise):
    """Take vertices from a simplex that spans less than it should, leaving the side nearest the origin. Returns how many stay."""
    if n == 4 and spacious(vertex, noise):
        return 4
    if n == 4 and height(vertex, 1) > noise and height(vertex, 2) > noise and height(vertex, 3) <= noise:
        best, skipped = np.inf, 3
        for k in range(4):
            p, q, r = (k + 1) % 4, (k + 2) % 4, (k + 3) % 4
            _, _, _, found = side(vertex[0, p], vertex[1, p], vertex[2, p], vertex[0, q], vertex[1, q], vertex[2, q],
                                  vertex[0, r], vertex[1, r], vertex[2, r])
            if found < best:
                best, skipped = found, k
        n = keep(vertex, label, weight,
                 1.0 * (skipped != 0), 1.0 * (skipped != 1), 1.0 * (skipped != 2), 1.0 * (skipped != 3))
    spanning = 1
    while spanning < n and height(vertex, spanning) > noise:
        spanning += 1
    return spanning


@formula
def remember(points, vertex, label, n, i, j):
    """The difference of columns i and j becomes vertex n."""
    vertex[0, n], vertex[1, n], vertex[2, n] = points[0, i] - points[0, j], points[1, i] - points[1, j], points[2, i] - points[2, j]
    label[0, n], label[1, n] = i, j


@kernel
def inflate(points, neighbours, neighbour, seen, start_a, size_a, row_a, start_b, size_b, row_b, noise, n,
            vertex, label, weight):
    """Add vertices to the simplex until it has four, or the difference no more dimensions. Returns how many it has."""
    n = drop_flat(vertex, label, weight, n, noise)
    while n < 4:
        farthest, a, b = noise, -1, -1
        for t in range(6 if n == 1 else 4 if n == 2 else 2):
            dx, dy, dz = trial(vertex, n, t)
            i = support(points, start_a, size_a, row_a, neighbours, neighbour, seen, start_a, dx, dy, dz)
            j = support(points, start_b, size_b, row_b, neighbours, neighbour, seen, start_b, -dx, -dy, -dz)
            remember(points, vertex, label, n, i, j)
            far = height(vertex, n)
            if far > farthest:
                farthest, a, b = far, i, j
        if a < 0:
            return n
        remember(points, vertex, label, n, a, b)
        n += 1
    return n


@formula
def edge(f, e):
    """Edge e of face f, from its corner e to the next, as one number."""
    return 4 * f + e


@formula
def ends(code):
    """The face and the edge of a number."""
    return code >> 2, code & 3


@formula
def following(k, n):
    """k + 1, after n - 1 again 0."""
    return k + 1 if k + 1 < n else 0


@formula
def place(vertex, corner, across, plane, noise, f, a, b, c, beyond_ab, beyond_bc, beyond_ca):
    """Face f becomes the triangle of vertices a, b, c."""
    ax, ay, az = vertex[0, a], vertex[1, a], vertex[2, a]
    ux, uy, uz, wx, wy, wz = (vertex[0, b] - ax, vertex[1, b] - ay, vertex[2, b] - az,
                              vertex[0, c] - ax, vertex[1, c] - ay, vertex[2, c] - az)
    nx, ny, nz = cross(ux, uy, uz, wx, wy, wz)
    size, longest = dot(nx, ny, nz, nx, ny, nz), max(dot(ux, uy, uz, ux, uy, uz), dot(wx, wy, wz, wx, wy, wz))
    corner[0, f], corner[1, f], corner[2, f] = a, b, c
    across[0, f], across[1, f], across[2, f] = beyond_ab, beyond_bc, beyond_ca
    if size <= noise * noise * longest:
        plane[0, f], plane[1, f], plane[2, f], plane[3, f] = 0.0, 0.0, 0.0, np.inf
    else:
        inverse = 1.0 / np.sqrt(size)
        nx, ny, nz = nx * inverse, ny * inverse, nz * inverse
        plane[0, f], plane[1, f], plane[2, f], plane[3, f] = nx, ny, nz, nx * ax + ny * ay + nz * az


@formula
def tetrahedral(vertex, corner, across, plane, noise):
    """The four faces of the first four vertices."""
    px, py, pz = vertex[0, 0], vertex[1, 0], vertex[2, 0]
    nx, ny, nz = cross(vertex[0, 1] - px, vertex[1, 1] - py, vertex[2, 1] - pz,
                       vertex[0, 2] - px, vertex[1, 2] - py, vertex[2, 2] - pz)
    above = dot(nx, ny, nz, vertex[0, 3] - px, vertex[1, 3] - py, vertex[2, 3] - pz) > 0.0
    a, b = (2, 1) if above else (1, 2)
    place(vertex, corner, across, plane, noise, 0, 0, a, b, edge(1, 2), edge(2, 2), edge(3, 2))
    place(vertex, corner, across, plane, noise, 1, 0, 3, a, edge(3, 1), edge(2, 0), edge(0, 0))
    place(vertex, corner, across, plane, noise, 2, a, 3, b, edge(1, 1), edge(3, 0), edge(0, 1))
    place(vertex, corner, across, plane, noise, 3, b, 3, 0, edge(2, 1), edge(1, 0), edge(0, 2))


@formula
def silhouette(vertex, across, plane, visible, horizon, stack, noise, f, w):
    """Flood from face f over all faces that vertex w sees, those in its plane included.

    Returns how many there are, listed in `visible` with their distances set to -inf, and how many edges bound them, listed in
    `horizon` in order; no edges where all faces are seen.
    """
    wx, wy, wz = vertex[0, w], vertex[1, w], vertex[2, w]
    visible[0], plane[3, f] = f, -np.inf
    seen, edges, waiting = 1, 0, 3
    stack[0], stack[1], stack[2] = across[2, f], across[1, f], across[0, f]
    while waiting > 0:
        waiting -= 1
        code = stack[waiting]
        g, e = ends(code)
        distance = plane[3, g]
        if distance == -np.inf:
            continue
        if distance == np.inf or plane[0, g] * wx + plane[1, g] * wy + plane[2, g] * wz - distance > -noise:
            visible[seen], plane[3, g] = g, -np.inf
            seen += 1
            e = following(e, 3)
            stack[waiting], stack[waiting + 1] = across[following(e, 3), g], across[e, g]
            waiting += 2
        else:
            horizon[edges] = code
            edges += 1
    return seen, edges


@formula
def ring(corner, horizon, edges):
    """Whether the horizon is one closed ring about the faces seen, as it is but for rounding."""
    for k in range(edges):
        g, e = ends(horizon[k])
        h, d = ends(horizon[following(k, edges)])
        if corner[e, g] != corner[following(d, 3), h]:
            return False
    return edges >= 3


@formula
def slot(visible, seen, faces, k):
    """Where new face k goes: into the place of one that is seen, then behind the last."""
    return visible[k] if k < seen else faces + k - seen


@formula
def cone(vertex, corner, across, plane, visible, horizon, noise, seen, edges, faces, w):
    """The faces between the horizon and vertex w take the place of those that it sees. Returns how many places are in use.

    There are two more of them, unless vertices have gone too: a place that is left over stays behind as a face without area.
    """
    before, f = slot(visible, seen, faces, edges - 1), slot(visible, seen, faces, 0)
    for k in range(edges):
        g, e = ends(horizon[k])
        after = slot(visible, seen, faces, following(k, edges))
        across[e, g] = edge(f, 0)
        place(vertex, corner, across, plane, noise, f, corner[following(e, 3), g], corner[e, g], w,
              horizon[k], edge(after, 2), edge(before, 1))
        before, f = f, after
    for k in range(edges, seen):
        plane[3, visible[k]] = np.inf
    return max(faces, faces + edges - seen)


@formula
def lowest(plane, faces):
    """The face nearest the origin, the first of equals."""
    best, distance = 0, plane[3, 0]
    for f in range(1, faces):
        best = f if plane[3, f] < distance else best
        distance = plane[3, f] if plane[3, f] < distance else distance
    return best


@formula
def corners_of(vertex, corner, f):
    """The corners of face f."""
    p, q, r = corner[0, f], corner[1, f], corner[2, f]
    return (vertex[0, p], vertex[1, p], vertex[2, p], vertex[0, q], vertex[1, q], vertex[2, q],
            vertex[0, r], vertex[1, r], vertex[2, r])


@kernel
def pierced(vertex, corner, plane, faces, f, noise):
    """Of the faces in the plane of f, the one that the origin's projection falls into, or comes nearest to."""
    u, v, w, _, _, _ = areas(*corners_of(vertex, corner, f))
    if u > 0.0 and v > 0.0 and w > 0.0:
        return f
    _, _, _, best = side(*corners_of(vertex, corner, f))
    chosen, nx, ny, nz, distance = f, plane[0, f], plane[1, f], plane[2, f], plane[3, f]
    for g in range(faces):
        ax, ay, az, bx, by, bz, cx, cy, cz = corners_of(vertex, corner, g)
        deepest = min(min(dot(nx, ny, nz, ax, ay, az), dot(nx, ny, nz, bx, by, bz)), dot(nx, ny, nz, cx, cy, cz))
        if plane[3, g] < np.inf and deepest >= distance - noise:
            _, _, _, found = side(ax, ay, az, bx, by, bz, cx, cy, cz)
            if found < best:
                best, chosen = found, g
    return chosen


@kernel
def expand(points, neighbours, neighbour, seen, start_a, size_a, row_a, start_b, size_b, row_b, noise,
           vertex, label, corner, across, plane, visible, horizon, stack):
    """The hit face, from a tetrahedron of the first four vertices: its number. Differences of `noise` [m] are none."""
    tetrahedral(vertex, corner, across, plane, noise)
    n, faces, i, j = 4, 4, label[0, 3], label[1, 3]
    room, room_faces = vertex.shape[1], plane.shape[1]
    f = lowest(plane, faces)
    while n < room and 2 * n - 2 <= room_faces:
        nx, ny, nz, distance = plane[0, f], plane[1, f], plane[2, f], plane[3, f]
        i = support(points, start_a, size_a, row_a, neighbours, neighbour, seen, i, nx, ny, nz)
        j = support(points, start_b, size_b, row_b, neighbours, neighbour, seen, j, -nx, -ny, -nz)
        remember(points, vertex, label, n, i, j)
        if dot(nx, ny, nz, vertex[0, n], vertex[1, n], vertex[2, n]) - distance <= noise or known(label, n, i, j):
            break
        gone, edges = silhouette(vertex, across, plane, visible, horizon, stack, noise, f, n)
        if not ring(corner, horizon, edges):
            for k in range(gone):       # the polytope is as good as rounding allows
                g = visible[k]
                place(vertex, corner, across, plane, noise, g, corner[0, g], corner[1, g], corner[2, g],
                      across[0, g], across[1, g], across[2, g])
            break
        faces = cone(vertex, corner, across, plane, visible, horizon, noise, gone, edges, faces, n)
        n += 1
        f = lowest(plane, faces)
    return pierced(vertex, corner, plane, faces, f, noise)


@kernel
def hit_face(points, neighbours, neighbour, seen, start_a, size_a, row_a, start_b, size_b, row_b, noise, n,
             vertex, label, weight, corner, across, plane, visible, horizon, stack):
    """The hit face of two hulls whose difference has n vertices in a simplex. Differences of `noise` [m] are rounding.

    Returns POINT, LINE, PLANE or SOLID, what the difference is, the outward normal and the three vertices, some of them the same
    where it is a point or a line. Of the two sides of a plane, and of all directions across a line or from a point, a fixed one
    is taken.
    """
    n = inflate(points, neighbours, neighbour, seen, start_a, size_a, row_a, start_b, size_b, row_b, noise, n,
                vertex, label, weight)
    if n == SOLID:
        f = expand(points, neighbours, neighbour, seen, start_a, size_a, row_a, start_b, size_b, row_b, noise,
                   vertex, label, corner, across, plane, visible, horizon, stack)
        return SOLID, plane[0, f], plane[1, f], plane[2, f], corner[0, f], corner[1, f], corner[2, f]
    if n == POINT:
        return POINT, 0.0, 0.0, -1.0, 0, 0, 0
    nx, ny, nz = trial(vertex, n, 0)
    length = np.sqrt(dot(nx, ny, nz, nx, ny, nz))
    return n, nx / length, ny / length, nz / length, 0, 1, n - 1
