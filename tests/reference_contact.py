"""The naive twin's colliders and contacts: particles, and rigid bodies as a whole, against surfaces."""

from dataclasses import dataclass

import numpy as np

from verlet_numba.effects.response import SETTLED, SWEEPS  # how far the contacts of a rigid body are iterated


def turned(axis, angle):
    """Rotation matrix about a unit axis: exp of its cross product matrix, by its eigenvectors (Rodrigues)."""
    K = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


def on_path(path, t):
    return np.array([np.interp(t, path[:, 0], path[:, axis]) for axis in (1, 2, 3)])


@dataclass
class Solid:
    """One surface: `distance` of a point in its own frame, with the outward normal there."""

    collider: object
    distance: object
    start: np.ndarray

    def pose(self, t):
        """Origin and rotation at time t."""
        origin, rotation = self.start, np.eye(3)
        if self.collider.path:
            path = np.array(self.collider.path, float)
            origin = origin + on_path(path, t) - path[0, 1:]
        if self.collider.spin:
            axis = np.array(self.collider.spin.axis, float)
            rotation = turned(axis / np.linalg.norm(axis), self.collider.spin.rate * t)
        return origin, rotation


def plane(normal, offset):
    return lambda p: (normal @ p - offset, normal)


def sphere(radius):
    return lambda p: (np.linalg.norm(p) - radius, p / np.linalg.norm(p))


def box(half):
    def distance(p):
        nearest = np.clip(p, -half, half)
        if (nearest != p).any():
            out = p - nearest
            return np.linalg.norm(out), out / np.linalg.norm(out)
        axis = np.argmin(half - np.abs(p))
        return abs(p[axis]) - half[axis], np.copysign(np.eye(3)[axis], p)
    return distance


def cylinder(axis, radius, half):
    def distance(p):
        along = p @ axis
        out = p - along * axis
        beside = np.linalg.norm(out)
        flat, normal = box(np.array([radius, half, np.inf]))(np.array([beside, along, 0.0]))
        return flat, normal[0] * out / beside + normal[1] * axis
    return distance


def unit(vector):
    return np.array(vector, float) / np.linalg.norm(vector)


def solids(collider):
    start = np.array(collider.point if collider.kind == "plane" else collider.position, float)
    match collider.kind:
        case "plane":
            surfaces = [plane(unit(collider.normal), 0.0)]
        case "room":
            surfaces = [plane(-side * np.eye(3)[axis], -collider.size[axis] / 2) for axis in range(3) for side in (-1, 1)]
        case "box":
            surfaces = [box(np.array(collider.size) / 2)]
        case "sphere":
            surfaces = [sphere(collider.radius)]
        case "cylinder":
            surfaces = [cylinder(unit(collider.axis), collider.radius, collider.length / 2)]
    return [Solid(collider, surface, start) for surface in surfaces]


@dataclass
class Contact:
    """Particle k must stay on the upper side of a plane: normal . x >= bound."""

    k: int
    solid: Solid
    normal: np.ndarray
    bound: float
    anchor: np.ndarray          # the particle's place at the start of the substep, carried along by the collider
    push: float = 0.0
    rebound: float = 0.0

    def height(self, x):
        return self.normal @ x[self.k] - self.bound

    def approach(self, x):
        return self.normal @ (x[self.k] - self.anchor)

    def slide(self, place):
        """What a particle at `place` has moved along the surface in this substep."""
        moved = place - self.anchor
        return moved - (moved @ self.normal) * self.normal


def find_contact(k, here, before, radius, solid, margin, t, h):
    """The contact of a particle that was at `before` at t and is predicted at `here` at t + h, or None."""
    (o, R), (o_before, R_before) = solid.pose(t + h), solid.pose(t)
    local, local_before = R.T @ (here - o), R_before.T @ (before - o_before)
    gap, normal = solid.distance(local)
    if gap - radius >= margin:
        return None
    surface = local - gap * normal
    if gap < 0 < solid.distance(local_before)[0]:        # came from outside: the surface that it was nearest to
        gap, normal = solid.distance(local_before)
        surface = local_before - gap * normal
    return Contact(k, solid, R @ normal, (R @ normal) @ (o + R @ surface) + radius, o + R @ local_before)


def impact(before, after, a, h, e):
    """Gap and displacement at the end of a step in which a particle falls through gap 0 and rebounds (see below).

    The path with constant acceleration through both gaps meets 0 after s; the flight from there is
    g(tau) = e u tau + a tau^2/2, u the speed of impact. A flight shorter than a step is none: the particle rests.
    """
    v = (after - before) / h - a * h / 2
    s = min(root.real for root in np.roots([a / 2, v, before]) if abs(root.imag) < 1e-9 * h and root.real > -1e-9 * h)
    rise = -e * (v + a * s)
    if rise <= 0 or rise + a * h / 2 <= 0:
        return 0.0, 0.0
    end, begin = (rise * tau + a * tau**2 / 2 for tau in (h - s, -s))
    return end, end - begin


def held(slide, push, static, dynamic):
    """Which part of a slide Coulomb friction takes back."""
    if slide <= static * push:
        return 1.0
    return dynamic * push / slide


def settled(before, after):
    """Whether a sweep changed impulses, numbers or vectors, by next to nothing."""
    change = np.abs(np.array(after) - np.array(before)).max(initial=0)
    return change <= SETTLED * max((np.linalg.norm(impulse) for impulse in after), default=0)


class Whole:
    """A rigid body that answers to its contacts as a whole.

    An impulse J at the arm r moves the body by J/M and turns it by I^-1 (r x J). Pushes are those of a lone particle: J w_k.
    """

    def __init__(self, twin, particles):
        self.twin, self.particles = twin, particles

    def gather(self):
        """The body's contacts, the last found first, and its mass, centre and inertia where it is."""
        twin = self.twin
        self.contacts = [contact for contact in reversed(twin.contacts) if contact.k in self.particles]
        x, m = twin.x[self.particles], twin.mass[self.particles]
        self.mass, self.centre = m.sum(), m @ x / m.sum()
        inertia = sum(mass * ((r @ r) * np.eye(3) - np.outer(r, r)) for mass, r in zip(m, x - self.centre, strict=True))
        self.inverse_inertia = np.linalg.inv(inertia)

    def arm(self, contact):
        return self.twin.x[contact.k] - self.centre

    def response(self, contact, direction):
        """Displacement of the contact's particle along a unit direction by a unit impulse, kg^-1."""
        lever = np.cross(self.arm(contact), direction)
        return 1 / self.mass + lever @ self.inverse_inertia @ lever

    def twist(self, wanted, given):
        """Translation and rotation that make every contact rise by what is `wanted`, with pushes `given` never below 0."""
        shift, turn = np.zeros(3), np.zeros(3)
        impulses = [push / self.twin.w[contact.k] for push, contact in zip(given, self.contacts, strict=True)]
        for _ in range(SWEEPS):
            before = impulses.copy()
            for c, contact in enumerate(self.contacts):
                n = contact.normal
                rise = n @ (shift + np.cross(turn, self.arm(contact)))
                impulses[c] = max(0.0, before[c] + (wanted[c] - rise) / self.response(contact, n))
                shift, turn = self.pushed(shift, turn, contact, (impulses[c] - before[c]) * n)
            if settled(before, impulses):
                break
        given[:] = [impulse * self.twin.w[contact.k] for impulse, contact in zip(impulses, self.contacts, strict=True)]
        return shift, turn

    def pushed(self, shift, turn, contact, impulse):
        return shift + impulse / self.mass, turn + self.inverse_inertia @ np.cross(self.arm(contact), impulse)

    def move(self, shift, turn):
        angle = np.linalg.norm(turn)
        rotation = turned(turn / angle, angle) if angle > 0 else np.eye(3)
        for p in self.particles:
            self.twin.x[p] = self.centre + shift + rotation @ (self.twin.x[p] - self.centre)
        self.centre = self.centre + shift

    def separate(self):
        pushes = [contact.push for contact in self.contacts]
        twist = self.twist([-contact.height(self.twin.x) for contact in self.contacts], pushes)
        for contact, push in zip(self.contacts, pushes, strict=True):
            contact.push = push
        self.move(*twist)

    def bounce(self):
        """Contacts that rebound get the displacement that they leave with, by a twist of the previous positions."""
        leaves = [contact.rebound > 0 and contact.push > 0 for contact in self.contacts]
        wanted = [contact.rebound - contact.approach(self.twin.x) if leave else -np.inf
                  for contact, leave in zip(self.contacts, leaves, strict=True)]
        given = [0.0] * len(wanted)
        shift, turn = self.twist(wanted, given)
        for contact, push in zip(self.contacts, given, strict=True):
            contact.push += push
        for p in self.particles:
            self.twin.previous[p] -= shift + np.cross(turn, self.twin.x[p] - self.centre)

    def rub(self):
        """A twist that takes back the sliding at every contact, each within its cone."""
        shift, turn = np.zeros(3), np.zeros(3)
        impulses = [np.zeros(3) for _ in self.contacts]
        for _ in range(SWEEPS):
            before = impulses.copy()
            for c, contact in enumerate(self.contacts):
                slide = contact.slide(self.twin.x[contact.k] + shift + np.cross(turn, self.arm(contact)))
                length = np.linalg.norm(slide)
                if contact.push <= 0 or length == 0:
                    continue
                wished = impulses[c] - slide / self.response(contact, slide / length)
                size = np.linalg.norm(wished) * self.twin.w[contact.k]
                impulses[c] = wished * held(size, contact.push, *self.twin.friction(contact))
                shift, turn = self.pushed(shift, turn, contact, impulses[c] - before[c])
            if settled(before, impulses):
                break
        self.move(shift, turn)
