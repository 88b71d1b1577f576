"""The bodies of a scene, one model a kind."""

from collections.abc import Iterable
from math import dist
from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag

from .schema_common import (
    Finding,
    Fraction,
    Friction,
    Integer,
    Length,
    Mass,
    Name,
    Number,
    Part,
    Rotation,
    Sides,
    Speed,
    StickLength,
    Switch,
    Thickness,
    Trajectory,
    Vector,
    Whole,
)

MAX_PARTICLES = 10_000_000        # of one copy of a body

Compliance = Annotated[Number, Field(ge=0, le=1e12)]
Numbers = tuple[Whole, ...]
Side = Annotated[Integer, Field(ge=2, le=MAX_PARTICLES)]


def _word_or_numbers(value: Any) -> str:
    return "<word>" if isinstance(value, str) else "<numbers>"


def _row_of(*lengths: int) -> Any:
    """Tells rows of different lengths apart."""
    return lambda row: f"<{len(row)}>" if isinstance(row, list | tuple) and len(row) in lengths else None


_PINNED = Discriminator(_word_or_numbers)
PinnedCloth = Annotated[
    Annotated[Numbers, Tag("<numbers>")] | Annotated[Literal["corners", "border"], Tag("<word>")], _PINNED]
PinnedRope = Annotated[Annotated[Numbers, Tag("<numbers>")] | Annotated[Literal["ends"], Tag("<word>")], _PINNED]

Stick = Annotated[
    Annotated[tuple[Whole, Whole], Tag("<2>")] | Annotated[tuple[Whole, Whole, StickLength], Tag("<3>")],
    Discriminator(_row_of(2, 3), "row", "a stick is [i, j] or [i, j, length]: two particle numbers, and a length in m")]
Degrees = Annotated[Number, Field(ge=0, le=180)]
Angle = Annotated[
    Annotated[tuple[Whole, Whole, Whole], Tag("<3>")] | Annotated[tuple[Whole, Whole, Whole, Degrees], Tag("<4>")],
    Discriminator(_row_of(3, 4), "row", "an angle is [i, j, k] or [i, j, k, degrees]: three particle numbers, the "
                                        "angle is that at the middle one")]


class Scatter(Part):
    """Places copies at random without overlap, with random rotations, from the scene's seed."""

    inside: tuple[Vector, Vector] = Field(description="two opposite corners of the region, the lower first, m")
    speed: tuple[Speed, Speed] = Field(
        default=(0.0, 0.0), description="least and greatest speed, uniform in between, directions uniform, m/s")

    def findings(self) -> Iterable[Finding]:
        lower, upper = self.inside
        for axis in range(3):
            if lower[axis] > upper[axis]:
                yield ("inside", 1, axis), f"{upper[axis]:g} m is below the lower corner's {lower[axis]:g} m"
        if self.speed[0] > self.speed[1]:
            yield ("speed",), f"the least speed {self.speed[0]:g} m/s is above the greatest, {self.speed[1]:g} m/s"


class BaseBody(Part):
    """What all bodies have."""

    name: Name = Field(
        default="", description="how paths, attachments and results call it; KIND_INDEX if left out, such as cloth_0")
    position: Vector = Field(default=(0.0, 0.0, 0.0), description="where the body's own origin is put, m")
    rotation: Rotation | None = Field(
        default=None, description="turn from the body's own axes to those of the world, about the centre of mass of "
                                  "ropes, boxes, icosahedra and particles, else about the body's own origin")
    velocity: Vector = Field(default=(0.0, 0.0, 0.0), description="initial velocity of the centre of mass, m/s")
    angular_velocity: Vector = Field(default=(0.0, 0.0, 0.0), description="about the centre of mass, world axes, rad/s")
    count: Annotated[Integer, Field(ge=1, le=1_000_000)] = Field(
        default=1, description="number of copies; above 1 `scatter` places them")
    scatter: Scatter | None = Field(default=None, description="random places for the copies")
    fixed: Switch = Field(default=False, description="whether no particle moves on its own; it may still follow `path`")
    path: Trajectory | None = Field(
        default=None, description="rows [t, x, y, z] (s, m): pinned particles are carried along by path(t) - "
                                  "path(first), straight from row to row")
    friction: Friction | None = Field(
        default=None, description="{static, dynamic} or one number for both; that of `effects` if left out")
    restitution: Fraction | None = Field(
        default=None, description="part of the normal speed that an impact gives back; that of `effects` if left out")

    @property
    def particles(self) -> int | None:
        """Number of particles of one copy; None if only a file can tell."""
        return None

    def pinned_numbers(self) -> Numbers:
        """Numbers under `pinned`; empty if a word stands there."""
        pinned = getattr(self, "pinned", ())
        return pinned if isinstance(pinned, tuple) else ()

    def findings(self) -> Iterable[Finding]:
        particles = self.particles
        if particles is not None:
            if particles > MAX_PARTICLES:
                yield (), f"has {particles:,} particles; at most {MAX_PARTICLES:,} are possible"
            for row, number in enumerate(self.pinned_numbers()):
                yield from _in_range(("pinned", row), number, particles)
        if self.count > 1 and self.scatter is None:
            yield ("count",), f"{self.count} copies need `scatter: {{inside: [[x, y, z], [x, y, z]]}}` to place them"
        if self.path is not None and not self.fixed and not getattr(self, "pinned", ()):
            yield ("path",), "a path carries pinned particles, and none is pinned; add `pinned` or `fixed: true`"


def _in_range(path: tuple[str | int, ...], number: int, particles: int) -> Iterable[Finding]:
    if number >= particles:
        yield path, f"there is no particle {number}: the body has {particles}, numbered from 0"


class MassOrDensity(BaseBody):
    """Bodies whose particles share one mass equally."""

    mass: Mass | None = Field(default=None, description="of the whole body, shared equally among its particles, kg")
    density: Mass | None = Field(default=None, description="in place of `mass`: kg/m^3, of cloth kg/m^2, of ropes kg/m")

    def findings(self) -> Iterable[Finding]:
        yield from super().findings()
        if self.mass is None and self.density is None:
            yield (), "has neither mass nor density; give one of them"
        if self.mass is not None and self.density is not None:
            yield ("density",), "stands beside mass; give only one of the two"


class Cloth(MassOrDensity):
    """A rectangular sheet in the xy plane, centred at its position; particle (i, j) has number i ny + j."""

    kind: Literal["cloth"]
    size: tuple[Length, Length] = Field(description="sides along x and y, m")
    resolution: tuple[Side, Side] = Field(
        description="particles along x and y, at least 2 each")
    diagonals: Literal["both", "one"] = Field(
        default="both", description="`one`: exactly the edges of the triangles are sticks; `both`: the other "
                                    "diagonals too")
    thickness: Thickness = Field(default=0.01, description="diameter for contacts, m")
    compliance: Compliance = Field(default=0.0, description="of every stick, m/N; 0 is inextensible")
    pinned: PinnedCloth = Field(
        default=(), description="numbers of particles that stay in place, or `corners`, or `border`")

    @property
    def particles(self) -> int:
        return self.resolution[0] * self.resolution[1]


def _distance(data: dict[str, Any]) -> float:
    return dist(data["start"], data["end"])


class Rope(MassOrDensity):
    """`segments` + 1 particles from start to end; a slack rope hangs as a circular arc below the chord."""

    kind: Literal["rope"]
    start: Vector = Field(description="first particle, before `position` and `rotation`, m")
    end: Vector = Field(description="last particle, before `position` and `rotation`, m")
    length: Length = Field(
        default_factory=_distance, description="m, at least the distance from start to end, which it is if left out")
    segments: Annotated[Integer, Field(ge=1, lt=MAX_PARTICLES)] = Field(
        description="sticks from start to end, of equal length")
    thickness: Thickness = Field(default=0.01, description="diameter for contacts, m")
    compliance: Compliance = Field(default=0.0, description="of every stick, m/N; 0 is inextensible")
    pinned: PinnedRope = Field(default=(), description="numbers of particles that stay in place, or `ends`")

    @property
    def particles(self) -> int:
        return self.segments + 1

    def findings(self) -> Iterable[Finding]:
        yield from super().findings()
        distance = dist(self.start, self.end)
        if self.length == 0:
            yield ("end",), "is where the rope starts; move it, or say how long the rope is with `length`"
        elif self.length < distance * (1 - 1e-12):
            yield ("length",), f"{self.length:g} m is shorter than the {distance:g} m from start to end"
        elif self.segments == 1 and self.length > distance * (1 + 1e-12):
            yield ("segments",), f"one segment cannot be slack: it is {self.length:g} m long over {distance:g} m"


class Box(MassOrDensity):
    """A rigid box centred at its position; particle 4 ix + 2 iy + iz is the corner with ix, iy, iz in {0, 1}."""

    kind: Literal["box"]
    size: Sides = Field(description="sides along x, y and z before rotation, m")
    pinned: Numbers = Field(default=(), description="numbers of particles that stay in place")

    @property
    def particles(self) -> int:
        return 8


class Icosahedron(MassOrDensity):
    """A rigid regular icosahedron centred at its position."""

    kind: Literal["icosahedron"]
    radius: Length = Field(description="from the centre to the vertices, m")
    pinned: Numbers = Field(default=(), description="numbers of particles that stay in place")

    @property
    def particles(self) -> int:
        return 12


class Mesh(MassOrDensity):
    """A rigid body from a file of triangles; the file's origin is put at its position."""

    kind: Literal["mesh"]
    file: Annotated[str, Field(min_length=1, max_length=4096)] = Field(
        description="closed surface of triangles (OBJ, OFF, PLY, STL), relative to the scene file; one that is not convex "
                    "is split into convex parts by the extra `mesh`")
    scale: Length = Field(default=1.0, description="factor from the file's unit to m")
    pinned: Numbers = Field(default=(), description="numbers of particles that stay in place")

    @property
    def particles(self) -> None:
        return None


class ParticlesBody(BaseBody):
    """Point masses and sticks, one by one."""

    kind: Literal["particles"]
    positions: Annotated[tuple[Vector, ...], Field(min_length=1)] = Field(
        description="one row a particle, before `position` and `rotation`, m")
    masses: tuple[Mass, ...] = Field(description="one a particle, kg")
    velocities: tuple[Vector, ...] | None = Field(
        default=None, description="initial velocities, one row a particle, on top of `velocity`, m/s")
    sticks: tuple[Stick, ...] = Field(
        default=(), description="distance constraints [i, j] at the initial length, or [i, j, length] in m")
    angles: tuple[Angle, ...] = Field(
        default=(), description="[i, j, k] keeps the initial angle at j; [i, j, k, degrees] another")
    compliance: Compliance = Field(default=0.0, description="of every stick, m/N; 0 is inextensible")
    radius: Thickness = Field(
        default=0.0, description="contact radius of every particle, m; 0 is a point, which still meets colliders and "
                                 "solids")
    contact_geometry: Literal["nodes", "segments"] = Field(
        default="nodes", description="whether only the particles collide, or sticks too, as capsules")
    pinned: Numbers = Field(default=(), description="numbers of particles that stay in place")

    @property
    def particles(self) -> int:
        return len(self.positions)

    def findings(self) -> Iterable[Finding]:
        yield from super().findings()
        particles = self.particles
        for key in ("masses", "velocities"):
            rows = getattr(self, key)
            if rows is not None and len(rows) != particles:
                yield (key,), f"has {len(rows)} entries for {particles} positions; give one for each"
        for key, rows, ends in (("sticks", self.sticks, 2), ("angles", self.angles, 3)):
            for row, entry in enumerate(rows):
                numbers = [int(number) for number in entry[:ends]]
                for end, number in enumerate(numbers):
                    yield from _in_range((key, row, end), number, particles)
                if len(set(numbers)) < ends:
                    yield (key, row), f"{numbers} names the same particle twice"


Body = Annotated[Cloth | Rope | Box | Icosahedron | Mesh | ParticlesBody, Field(discriminator="kind")]
BODIES: dict[str, type[BaseBody]] = {"cloth": Cloth, "rope": Rope, "box": Box, "icosahedron": Icosahedron, "mesh": Mesh,
                                    "particles": ParticlesBody}
