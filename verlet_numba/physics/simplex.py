"""The point of a simplex nearest the origin, as weights of its vertices: 1 in sum, exactly 0 for those that do not carry it.

Signed areas and volumes tell on which side of an edge or a face the origin lies; a convex set's point nearest an outside
point is on a side that this point sees. Areas are taken about a vertex and along edges, never as differences of products
of positions, so that a simplex far from the origin keeps its digits. Where a simplex is flat to rounding these signs mean
nothing, and all its sides are tried. Nothing depends on the unit of length.
"""

from verlet_numba._jit import formula

FLAT = 1e-11            # sine of an angle that counts as 0
FLAT_SQUARED = FLAT * FLAT


@formula
def cross(ax, ay, az, bx, by, bz):
    """a x b."""
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


@formula
def dot(ax, ay, az, bx, by, bz):
    """a . b."""
    return ax * bx + ay * by + az * bz


@formula
def segment(ax, ay, az, bx, by, bz):
    """Weights of a, b."""
    dx, dy, dz = bx - ax, by - ay, bz - az
    along, length = -dot(ax, ay, az, dx, dy, dz), dot(dx, dy, dz, dx, dy, dz)
    if along <= 0.0:
        return 1.0, 0.0
    if along >= length:
        return 0.0, 1.0
    return 1.0 - along / length, along / length


@formula
def mixed(ax, ay, az, bx, by, bz, u, v):
    """Square of the length of u a + v b."""
    x, y, z = u * ax + v * bx, u * ay + v * by, u * az + v * bz
    return x * x + y * y + z * z


@formula
def areas(ax, ay, az, bx, by, bz, cx, cy, cz):
    """Weights of a, b, c for the projection of the origin onto their plane, each times n . n, and n = (a - c) x (b - c).

    With o = -c the origin seen from c, that of a is (o x (b - c)) . n = o . ((b - c) x n), that of b likewise, and their sum n . n.
    """
    ux, uy, uz, wx, wy, wz = ax - cx, ay - cy, az - cz, bx - cx, by - cy, bz - cz
    nx, ny, nz = cross(ux, uy, uz, wx, wy, wz)
    la = -dot(cx, cy, cz, *cross(wx, wy, wz, nx, ny, nz))
    lb = -dot(cx, cy, cz, *cross(nx, ny, nz, ux, uy, uz))
    return la, lb, dot(nx, ny, nz, nx, ny, nz) - la - lb, nx, ny, nz


@formula
def triangle(ax, ay, az, bx, by, bz, cx, cy, cz):
    """Weights of a, b, c."""
    o, p, q, nx, ny, nz = areas(ax, ay, az, bx, by, bz, cx, cy, cz)
    ux, uy, uz, wx, wy, wz = ax - cx, ay - cy, az - cz, bx - cx, by - cy, bz - cz
    whole = dot(nx, ny, nz, nx, ny, nz)
    flat = whole <= FLAT_SQUARED * (dot(ux, uy, uz, ux, uy, uz) * dot(wx, wy, wz, wx, wy, wz))
    if o > 0.0 and p > 0.0 and q > 0.0 and not flat:
        return o / whole, p / whole, q / whole
    best, la, lb, lc = -1.0, 1.0, 0.0, 0.0
    if q <= 0.0 or flat:
        u, v = segment(ax, ay, az, bx, by, bz)
        best, la, lb = mixed(ax, ay, az, bx, by, bz, u, v), u, v
    if p <= 0.0 or flat:
        u, v = segment(ax, ay, az, cx, cy, cz)
        found = mixed(ax, ay, az, cx, cy, cz, u, v)
        if best < 0.0 or found < best:
            best, la, lb, lc = found, u, 0.0, v
    if o <= 0.0 or flat:
        u, v = segment(bx, by, bz, cx, cy, cz)
        found = mixed(bx, by, bz, cx, cy, cz, u, v)
        if best < 0.0 or found < best:
            best, la, lb, lc = found, 0.0, u, v
    return la, lb, lc


@formula
def side(ax, ay, az, bx, by, bz, cx, cy, cz):
    """Weights of a, b, c, and the square of the distance from the origin."""
    u, v, w = triangle(ax, ay, az, bx, by, bz, cx, cy, cz)
    x, y, z = u * ax + v * bx + w * cx, u * ay + v * by + w * cy, u * az + v * bz + w * cz
    return u, v, w, x * x + y * y + z * z


@formula
def tetrahedron(ax, ay, az, bx, by, bz, cx, cy, cz, dx, dy, dz):
    """Weights of a, b, c, d; all positive: the origin is inside.

    A vertex's weight is the volume that is left when the origin takes its place, over the whole one. With o = -d the origin
    seen from d, that of a is o . ((b - d) x (c - d)).
    """
    ux, uy, uz, vx, vy, vz, wx, wy, wz = ax - dx, ay - dy, az - dz, bx - dx, by - dy, bz - dz, cx - dx, cy - dy, cz - dz
    nx, ny, nz = cross(vx, vy, vz, wx, wy, wz)
    whole = dot(nx, ny, nz, ux, uy, uz)
    flat = whole * whole <= FLAT_SQUARED * (dot(nx, ny, nz, nx, ny, nz) * dot(ux, uy, uz, ux, uy, uz))
    sign = 1.0 if whole > 0.0 else -1.0
    whole = sign * whole
    la = -sign * dot(dx, dy, dz, nx, ny, nz)
    lb = -sign * dot(dx, dy, dz, *cross(wx, wy, wz, ux, uy, uz))
    lc = -sign * dot(dx, dy, dz, *cross(ux, uy, uz, vx, vy, vz))
    ld = whole - la - lb - lc
    if la > 0.0 and lb > 0.0 and lc > 0.0 and ld > 0.0 and not flat:
        return la / whole, lb / whole, lc / whole, ld / whole
    best, a, b, c, d = -1.0, 1.0, 0.0, 0.0, 0.0
    if ld <= 0.0 or flat:
        u, v, w, best = side(ax, ay, az, bx, by, bz, cx, cy, cz)
        a, b, c, d = u, v, w, 0.0
    if lc <= 0.0 or flat:
        u, v, w, found = side(ax, ay, az, bx, by, bz, dx, dy, dz)
        if best < 0.0 or found < best:
            best, a, b, c, d = found, u, v, 0.0, w
    if lb <= 0.0 or flat:
        u, v, w, found = side(ax, ay, az, cx, cy, cz, dx, dy, dz)
        if best < 0.0 or found < best:
            best, a, b, c, d = found, u, 0.0, v, w
    if la <= 0.0 or flat:
        u, v, w, found = side(bx, by, bz, cx, cy, cz, dx, dy, dz)
        if best < 0.0 or found < best:
            best, a, b, c, d = found, 0.0, u, v, w
    return a, b, c, d
