"""Convex hulls and how they meet."""

from typing import NamedTuple

from verlet_numba.buffers.arrays import Array
from verlet_numba.buffers.trees import Candidates

POINTS = 8                                              # contacts of a pair of hulls, at most


class Hulls(NamedTuple):
    """Convex hulls that meet: of rigid bodies (their convex parts) and of colliders. Corners stand hull by hull.

    A hull with a rounding is what lies within that distance of its corners' convex hull: one corner is a sphere.
    """

    body: Array                 # (H,) int 1; rigid body the hull belongs to (Rigid), -1: a collider's, which nothing moves
    start: Array                # (H + 1,) int 1; columns of hull h: start[h] to start[h + 1], a whole number of vectors
    size: Array                 # (H,) int 1; corners; columns after them repeat the first
    particle: Array             # (Q,) int 1; inner index of the corner's particle, -1: a collider's
    corner: Array               # (3, Q) double m; where the corners are
    centre: Array               # (3, H) double m; mean of the corners
    solid: Array                # (H,) int 1; collider whose hull it is, -1: none
    local: Array                # (3, Q) double m; corners in the frame of their body or collider
    reach: Array                # (H,) double m; radius of the sphere about the centre that holds the hull, rounding included
    rounding: Array             # (H,) double m
    flat: Array                 # (H,) int 1; 1: it shall rest on its faces, and meets another such hull in several contacts
    graph: Array                # (H,) int 1; first row of the hull's corners in `neighbours`, -1: corners are scanned
    neighbours: Array           # (E + 1,) int 1; neighbours of the corner of row e: neighbour[neighbours[e]:neighbours[e + 1]]
    neighbour: Array            # (U,) int 1; corner number within the hull


class Pairs(NamedTuple):
    """Pairs of hulls near each other, first < second, in ascending order; what each of them learnt stays with it."""

    listed: Array               # (1,) int 1; how many pairs there are
    first: Array                # (M,) int 1
    second: Array               # (M,) int 1
    axis: Array                 # (3, M) double 1; separating axis of the last substep, which starts the next; 0: none
    face: Array                 # (6, M) int 1; hit face of the last substep: corner numbers, three of either hull; -1: none
    push: Array                 # (M,) double kg m; impulse of the last substep between them, along the normal
    points: Array               # (M,) int 1; how many contacts that was at
    given: Array                # (M, 32) double kg m; at each: push, and grip as a vector on the first entity of the touch
    overlap: Array              # (M,) double m; what they overlapped when they met, as far as it is not yet given back
    met: Array                  # (M,) int 1; substep in which they met last


class Search(NamedTuple):
    """What the list of pairs was made for, and the scratch of the search that makes it (kernels/broad.py)."""

    made: Array                 # (1,) int 1; how often a list has been made; 0: never
    anchor: Array               # (3, H) double m; centres when the list was made
    extent: Array               # (H,) double m; reach when the list was made and slack: how far from there a hull may get
    last: Array                 # (2, 3, H) double m; centres at the last two calls
    turn: Array                 # (1,) int 1; which of these two is the older
    radius: Array               # (H,) double m; of the spheres that are searched
    order: Array                # (H,) int 1; hulls, those of a grid side by side
    key: Array                  # (H,) int 1; cell of each, in that order
    inverse: Array              # (G,) double 1/m; cells a metre, of each grid
    grid: Array                 # (4, G) int 1; its first entry in `cell`, its cells, their number from one to the next in y and z
    cell: Array                 # (C,) int 1; where each cell's spheres begin
    sphere: Array               # (S, 4) double m; centre and radius, cell by cell
    tag: Array                  # (S,) int 1; the cell's number and the hull's, as one
    code: Array                 # (M,) int 1; the hulls' numbers of a pair, as one


class Meetings(NamedTuple):
    """Contacts between hulls: points that are weighted corners of either."""

    listed: Array               # (1,) int 1; how many there are
    pair: Array                 # (T,) int 1; which of Pairs
    corner: Array               # (6, T) int 1; columns of Hulls.corner: three of the first hull, three of the second
    weight: Array               # (6, T) double 1; of each three the sum is 1
    normal: Array               # (3, T) double 1; from the second hull to the first
    gap: Array                  # (T,) double m; normal . (first point - second point) - roundings; negative: penetration
    push: Array                 # (T,) double m; how far the features have been moved apart in this substep (paper's response)
    give: Array                 # (2, T) double 1/kg; how they give way: sum of w c^2 over their particles


class Narrow(NamedTuple):
    """Scratch of the narrow phase: a simplex of at most four vertices, the first ones, that may grow into a polytope."""

    vertex: Array               # (3, V) double m; of the hulls' difference
    label: Array                # (2, V) int 1; the columns of Hulls.corner that it is the difference of
    weight: Array               # (4,) double 1; of the simplex' vertices, the point nearest the origin
    corner: Array               # (3, F) int 1; vertices of a face of the polytope, counterclockwise from outside
    across: Array               # (3, F) int 1; 4 times the face beyond edge e (corner e to e + 1), plus its edge there
    plane: Array                # (4, F) double 1; outward normal and distance from the origin [m]; infinite: no area
    visible: Array              # (F,) int 1; faces that the new vertex sees
    horizon: Array              # (3F + 3,) int 1; edges around them, as in `across`
    stack: Array                # (3F + 3,) int 1; edges still to cross
    seen: Array                 # (2S + 1,) int 1; of S corners: the flood that came by last, a queue; at the end: floods so far


class Beside(NamedTuple):
    """Scratch of the narrow phase on several threads: that of Narrow for every chunk of pairs."""

    vertex: Array               # (J, 3, V) double m
    label: Array                # (J, 2, V) int 1
    weight: Array               # (J, 4) double 1
    corner: Array               # (J, 3, F) int 1
    across: Array               # (J, 3, F) int 1
    plane: Array                # (J, 4, F) double 1
    visible: Array              # (J, F) int 1
    horizon: Array              # (J, 3F + 3) int 1
    stack: Array                # (J, 3F + 3) int 1
    seen: Array                 # (J, 2S + 1) int 1
    found: Array                # (J,) int 1; where the chunk's meetings end


class Manifold(NamedTuple):
    """Scratch of kernels/manifold.py, which gives pairs of hulls several contacts."""

    points: Array               # (T,) int 1; contacts that each of Meetings becomes, 0: it stays as it is
    corner: Array               # (6, T) int 1; those contacts, one after another; as in Meetings
    weight: Array               # (6, T) double 1
    gap: Array                  # (T,) double m
    near: Array                 # (Q,) int 1; columns of a hull's corners near its support plane; as many as a hull has
    spot: Array                 # (4, Q) double m; their coordinates in the plane, height over it, distance to those kept
    column: Array               # (2, 16) int 1; corners of the two support polygons
    polygon: Array              # (2, 2, 16) double m; and where they are in the plane
    distance: Array             # (2, 16, 16) double m; corners of one polygon from the edges of the other
    place: Array                # (3, 64) double m; points that both polygons share: coordinates in the plane, gap
    point_corner: Array         # (6, 64) int 1; the same as weighted corners
    point_weight: Array         # (6, 64) double 1
    ring: Array                 # (64,) int 1; the order of corners or points around their mean
    angle: Array                # (64,) double 1


class Ridges(NamedTuple):
    """The triangles among the hulls, and what surrounds their features (numbered as in Meshes, 7 of each triangle)."""

    triangle: Array             # (H,) int 1; number of the triangle that the hull is, -1: none
    closed: Array               # (F,) int 1; 1: of a mesh without a border, met from the front alone
    border: Array               # (G,) int 1; 1: the feature lies on the border
    start: Array                # (G + 1,) int 1; hulls of the triangles that share feature g: start[g] to start[g + 1] of `around`
    around: Array               # (A,) int 1


class Meet(NamedTuple):
    """How hulls meet."""

    still: Array                # (H,) int 1; 1: nothing moves the hull
    pairs: Pairs
    spare: Pairs
    met: Array                  # (1,) int 1; how many meetings there are of the pairs as hulls now stand, -1: they have not met yet
    search: Search
    narrow: Narrow
    beside: Beside | None       # None: one thread
    manifold: Manifold | None   # None: one contact a pair
    meetings: Meetings
    margin: float               # double m; how near two hulls are a contact
    horizon: int                # int 1; substeps that a list of pairs shall last
    coherent: int | None        # int 1; None: nothing is remembered from the last substep
    all_pairs: int | None       # int 1; None: pairs are found by grids
    ridges: Ridges | None       # None: there is no mesh collider


class Mixed(NamedTuple):
    """How particles of deformable bodies meet hulls: each is a hull of one corner, the first of its pairs."""

    candidates: Candidates
    at: Array                   # (3, n) real m; where the particles were when the candidates were listed
    hull: Array                 # (n,) int 1; of each particle, -1: none
    begin: Array                # (H + 1,) int 1; scratch: candidates of each hull
    pairs: Pairs
    spare: Pairs
    met: Array                  # (1,) int 1; as in Meet
    meetings: Meetings
    narrow: Narrow
    margin: float               # double m; how near a particle must come to be listed
    near: float                 # double m; how near it must come to be a contact
    coherent: int | None        # int 1; None: nothing is remembered from the last substep
