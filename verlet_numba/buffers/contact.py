"""Colliders, what touches them, and how bodies answer to touches and rest."""

from typing import NamedTuple

from verlet_numba.buffers.arrays import Array

PLANE, BOX, SPHERE, CYLINDER, MESH = 0, 1, 2, 3, 4      # Solids.kind
FEATURE, BODY, PRINTED = 0, 1, 2                        # Features.point
LOOSE, HUNG, RESTLESS, FIXED = 0, 1, 2, 3               # Rest.kind


class Solids(NamedTuple):
    """Colliders. A room is six planes. Poses are those at the start and at the end of the current substep."""

    kind: Array                 # (K,) int 1; PLANE, BOX, SPHERE, CYLINDER or MESH
    extent: Array               # (4, K) double m; plane: normal, offset; box: half edges; mesh: 0; else radius, half length
    origin: Array               # (3, K) double m; at the end of the substep
    rotation: Array             # (3, 3, K) double 1; columns are the axes, at the end of the substep
    origin_before: Array        # (3, K) double m
    rotation_before: Array      # (3, 3, K) double 1
    reach: Array                # (K,) double m; radius of a sphere about the origin that holds it, infinite for planes


class Meshes(NamedTuple):
    """Triangles of mesh colliders in their own frames, for particles: a tree of boxes each, nodes in preorder.

    Children of a node are k + 1 and skip[k + 1]. Features of a triangle are its face, its sides from corner 0, 1 and 2 on,
    and its corners. Their normals are the pseudonormals of Baerentzen & Aanaes (2005), the sum of the adjacent faces'
    normals, at corners weighted by angles. A mesh without a border is closed and has an inside; another is a sheet.
    """

    first: Array                # (K + 1,) int 1; nodes of collider k: first[k] to first[k + 1], none of other kinds
    closed: Array               # (K,) int 1; 1: the mesh has no border
    skip: Array                 # (M,) int 1; the node after the subtree; k + 1 of a leaf
    triangle: Array             # (M,) int 1; of a leaf, -1: an inner node
    box: Array                  # (M, 6) double m; least x, y, z, largest x, y, z
    corner: Array               # (F, 9) double m; x, y, z of each
    normal: Array               # (F, 21) double 1; of every feature
    border: Array               # (F, 7) int 1; 1: the feature lies on the border
    side: Array                 # (K, n) int 1; of a sheet that the particle was near last: 1 front, -1 behind; 0: it was not near


class Contacts(NamedTuple):
    """Particles that touch a collider in this substep, each a plane that it must stay above."""

    solids: Solids
    radius: Array               # (n,) real m; contact radius
    body: Array                 # (n,) int 1; rigid body that answers as a whole, -1: the particle answers alone
    planes_only: Array          # (n,) int 1; 1: the particle's body meets all other colliders as a hull
    near: Array                 # (B,) int 1; scratch: which of a batch of particles are near
    within: Array               # (n,) double m; how near a particle must come to be listed: its radius and a margin
    listed: Array               # (1,) int 1; how many contacts there are
    particle: Array             # (L,) int 1
    solid: Array                # (L,) int 1
    normal: Array               # (3, L) double 1
    bound: Array                # (L,) double m; normal . position must not be below it
    anchor: Array               # (3, L) double m; the particle's place at the start, carried along by the collider
    push: Array                 # (L,) double m; displacement along the normal given so far
    memory: Array               # (L,) int 1; which of the arrays below is the contact's
    keeper: Array               # (J,) int 1; collider that a rigid body's particle remembers: particle k has k, n + k, 2 n + k ...
    kept: Array                 # (J,) double kg m; impulse that it gave in the last substep, along the normal
    grip: Array                 # (3, J) double kg m; and across it
    overlap: Array              # (J,) double m; of both when they met, not yet given back
    met: Array                  # (J,) int 1; substep in which they met last


class Rigid(NamedTuple):
    """What answers to contacts as a whole: rigid bodies, behind them particles that meet hulls in this substep, last the world.

    A twist is a translation [m] and a rotation [rad] about the centre.
    """

    bodies: int                 # int 1; rigid bodies G; body b is entity b
    first: Array                # (E,) int 1; inner index of the first particle
    stride: Array               # (E,) int 1; from one particle to the next
    size: Array                 # (E,) int 1; particles
    reach: Array                # (E,) double m; from the centre to the farthest particle, 0 for single particles
    entity: Array               # (n,) int 1; of a particle that is touched on its own, -1: none
    touched: Array              # (1,) int 1; how many entities are touched in this substep
    order: Array                # (E,) int 1; which
    parent: Array               # (E,) int 1; of the forest of islands, -1: untouched
    mass: Array                 # (E, 10) double SI; 1/mass, centre, inverse inertia (xx, yy, zz, xy, xz, yz)
    step: Array                 # (E, 6) double SI; twist since the start of the substep, before contacts
    twist: Array                # (E, 6) double SI; given by the contacts in this pass
    moved: Array                # (E, 6) double SI; given in all passes of the substep
    kick: Array                 # (E, 6) double SI; given to the velocity alone


class Touches(NamedTuple):
    """Contacts between entities, gathered from Contacts and Meetings; an island is what hangs together by them."""

    until: Array                # (3,) int 1; where the touches of colliders, hulls, and particles with hulls end
    islands: Array              # (1,) int 1; how many islands
    first: Array                # (T,) int 1; entity
    second: Array               # (T,) int 1; entity, the last one is the world
    source: Array               # (T,) int 1; contact with a collider, or meeting
    order: Array                # (T,) int 1; touches island by island
    island: Array               # (T + 1,) int 1; where each island begins in `order`
    label: Array                # (E,) int 1; number of the island by its root
    line: Array                 # (T, 18) double SI; normal to the first, arms of both, slide so far, two directions across
    answer: Array               # (T, 9) double SI; wish, 1/response, static and dynamic friction, separation to leave with,
                                # inverse of the responses across (uu, uv, vv), restitution
    given: Array                # (T, 4) double kg m; push, grip in the two directions across, kick along the normal
    recalled: Array             # (T, 4) double kg m; what the last substep ended with: push, grip as a vector on the first entity


class Rest(NamedTuple):
    """Which rigid bodies rest (effects/rest.py). Bodies are numbered as in Hulls.body; an island is named by one of its bodies."""

    drift: float                # double m; a body none of whose particles gets farther from where it was is slow
    wait: int                   # int 1; substeps for which all of an island must have been slow
    awake: Array                # (1,) int 1; bodies of all kinds that move
    kind: Array                 # (G,) int 1; LOOSE, HUNG by pins, RESTLESS: moved by a path or attached, FIXED
    first: Array                # (G,) int 1; inner index of the first particle
    stride: Array               # (G,) int 1; from one particle to the next
    size: Array                 # (G,) int 1; particles
    reach: Array                # (G,) double m; of a sphere about the first particle that holds the body wherever it touches
    body: Array                 # (n,) int 1; rigid body of each particle, -1: none
    free: Array                 # (n,) real 1/kg; inverse mass, 0 of what rests
    anchor: Array               # (3, n) real m; where its body began to be slow; of what rests: a substep before it was put to rest
    quiet: Array                # (H,) int 1; 1: a hull that rests, or of what nothing moves
    depth: Array                # (G,) double m; of an island at rest: how deep its hulls penetrate
    resting: Array              # (G,) int 1; 1: at rest
    slow: Array                 # (G,) int 1; substeps for which the body has been slow
    since: Array                # (G,) int 1; substep after which it was put to rest
    island: Array               # (G,) int 1; with which it rests
    parent: Array               # (G,) int 1; of the forest of islands
    backed: Array               # (G,) int 1; 1: pushed by what nothing moves
    least: Array                # (G,) int 1; of an island: substeps for which all of it has been slow
    roused: Array               # (G,) int 1; 1: an island to wake


class Features(NamedTuple):
    """The paper's response: features of hulls are moved apart."""

    point: int                  # int 1; FEATURE, BODY or PRINTED: which masses place the point where two features meet
    mass: Array                 # (H,) double kg; of the hull's body
    mass_point: Array           # (J,) double kg; the same of hulls of bodies and of particles


class Friction(NamedTuple):
    particle: Array             # (2, n) real 1; static and dynamic
    solid: Array                # (2, Y) double 1; Y = I K: of every instance
    hull: Array                 # (2, H) double 1
    point: Array                # (2, J) double 1; hulls of bodies and of particles


class Restitution(NamedTuple):
    particle: Array             # (n,) real 1
    solid: Array                # (Y,) double 1; Y = I K: of every instance
    hull: Array                 # (H,) double 1
    point: Array                # (J,) double 1; hulls of bodies and of particles
    rebound: Array              # (L,) double m; displacement along the normal after the impact, 0 where there is none


class Orientation(NamedTuple):
    """Rigid bodies that are not to be turned inside out (effects/orientation.py)."""

    first: Array                # (G,) int 1; inner index of the first particle
    stride: Array               # (G,) int 1; from one particle to the next
    size: Array                 # (G,) int 1; particles
    corner: Array               # (4, G) int 1; inner indices of four particles that span a volume
    sign: Array                 # (G,) double 1; of that volume at rest
