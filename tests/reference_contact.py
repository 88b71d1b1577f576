"""The naive twin's colliders and contacts: particles, and rigid bodies as a whole, against surfaces."""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import null_space
from scipy.optimize import brentq

from verlet_numba.effects.aim import RECOVERY, SHARE, SMALL
from verlet_numba.effects.response import SETTLED, SWEEPS


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
        case "mesh":
            surfaces = []           # tests/unit/effects/test_mesh_collider.py: here nothing comes near one
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

    key = property(lambda self: (self.k, id(self.solid)))

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


class Whole:
    """A rigid body that answers to its contacts with colliders as a whole.

    An impulse J [kg m] at the arm r moves the body by J/M and turns it by I^-1 (r x J). Impulses, normal and along the
    surface, are found by Gauss-Seidel; a substep begins with those that the last one ended with.
    """

    def __init__(self, twin, particles):
        self.twin, self.particles = twin, particles
        self.kept, self.overlap, self.met = {}, {}, {}      # by particle and collider: impulse, grip; m not given back; substep
        x = twin.x[particles]
        self.size = np.linalg.norm(x - x.mean(axis=0), axis=1).max()

    def gather(self):
        """The body's contacts, mass, centre and inertia where it is, and the impulses to begin with."""
        twin = self.twin
        self.contacts = [contact for contact in twin.contacts if contact.k in self.particles]
        x, m = twin.x[self.particles], twin.mass[self.particles]
        self.mass, self.centre = m.sum(), m @ x / m.sum()
        inertia = sum(mass * ((r @ r) * np.eye(3) - np.outer(r, r)) for mass, r in zip(m, x - self.centre, strict=True))
        self.inverse_inertia = np.linalg.inv(inertia)
        for contact in self.contacts:
            impulse, grip = self.kept.get(contact.key, (0.0, np.zeros(3)))
            known = self.met.get(contact.key, -2) >= twin.number - 1
            contact.impulse = contact.recalled = impulse if known else 0.0
            contact.grip, contact.kick = known * (grip - (grip @ contact.normal) * contact.normal), 0.0

    def answer(self, contact):
        """Matrix (3, 3) of the displacement of the contact's point by an impulse there, 1/kg."""
        r = contact.arm
        K = np.array([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]])
        return np.eye(3) / self.mass - K @ self.inverse_inertia @ K

    def aim(self, contact):
        """How far a contact shall rise. What overlapped when they met stays for a while, most errors of a gap if it pushes on."""
        twin, n, k = self.twin, contact.normal, contact.key
        contact.arm, contact.moved = twin.x[contact.k] - self.centre, twin.x[contact.k] - contact.anchor
        gap, met = contact.height(twin.x), self.met.get(k, -2)
        error = 0.0 if contact.rebound > 0 else n @ contact.moved - gap
        standing = max(0.0, error)
        if met < twin.number - 1:
            self.overlap[k] = standing
        elif met < twin.number:
            self.overlap[k] = min(standing, max(0.0, self.overlap[k] - RECOVERY * self.size * twin.h))
        else:
            self.overlap[k] = min(standing, self.overlap[k])
        self.met[k] = twin.number
        if contact.recalled == 0:
            return -gap - self.overlap[k]
        later = np.clip((1 - SHARE) * error, -SMALL * self.size, SMALL * self.size)
        return -gap - (max(self.overlap[k], later) if error > 0 else later)

    def strike(self, contact, impulse):
        """The body moves and turns further by an impulse at a contact."""
        self.shift = self.shift + impulse / self.mass
        self.turn = self.turn + self.inverse_inertia @ np.cross(contact.arm, impulse)

    def risen(self, contact):
        return self.shift + np.cross(self.turn, contact.arm)

    def gripped(self, contact, push, slide):
        """The impulse along the surface that takes back the slide, or else opposes it as much as friction can."""
        across = null_space(contact.normal[None])
        answer, slide, before = across.T @ self.answer(contact) @ across, across.T @ slide, across.T @ contact.grip
        static, dynamic = self.twin.friction(contact)
        grip = before - np.linalg.solve(answer, slide)
        if np.linalg.norm(grip) > static * push:
            # the slide it leaves, answer (f - grip), is -a f: (answer + a) f = answer grip, with |f| = dynamic push
            def cut(a):
                return np.linalg.solve(answer + a * np.eye(2), answer @ grip)

            limit, high = dynamic * push, 1.0
            while np.linalg.norm(cut(high)) > limit:
                high *= 2
            grip = cut(brentq(lambda a: np.linalg.norm(cut(a)) - limit, 0.0, high, xtol=1e-14)) if limit > 0 else np.zeros(2)
        contact.grip = across @ grip
        return contact.grip - across @ before

    def iterate(self, once):
        """Sweep over the contacts, forth and back, until little changes; `once` gives what a contact changes and its push."""
        for sweep in range(SWEEPS):
            contacts = self.contacts if sweep % 2 == 0 else self.contacts[::-1]
            changes, pushes = zip(*[once(contact) for contact in contacts], strict=True)
            if max(changes) <= SETTLED * max(pushes):
                break

    def separate(self, first):
        """One pass: contacts rise as they shall, slides are taken back within the cone."""
        if not self.contacts:
            return
        self.shift, self.turn = np.zeros(3), np.zeros(3)
        wishes = {id(contact): self.aim(contact) for contact in self.contacts}
        if first:
            for contact in self.contacts:
                self.strike(contact, contact.impulse * contact.normal + contact.grip)

        def once(contact):
            n, u = contact.normal, self.risen(contact)
            push = max(0.0, contact.impulse + (wishes[id(contact)] - n @ u) / (n @ self.answer(contact) @ n))
            impulse = (push - contact.impulse) * n + self.gripped(contact, push, contact.moved + u)
            contact.impulse = push
            self.strike(contact, impulse)
            return np.abs(impulse).max(), push

        self.iterate(once)
        angle = np.linalg.norm(self.turn)
        rotation = turned(self.turn / angle, angle) if angle > 0 else np.eye(3)
        for p in self.particles:
            self.twin.x[p] = self.centre + self.shift + rotation @ (self.twin.x[p] - self.centre)
        self.centre = self.centre + self.shift

    def keep(self):
        """The impulses that the next substep begins with."""
        for contact in self.contacts:
            self.kept[contact.key] = contact.impulse, contact.grip
            contact.push = contact.impulse / self.mass

    def rebound(self):
        """Velocities: an impact leaves as it should, and no faster than so what was pushed out of an overlap."""
        if not self.contacts:
            return
        for contact in self.contacts:
            contact.moved = contact.moved + self.risen(contact)
        self.shift, self.turn = np.zeros(3), np.zeros(3)

        def once(contact):
            if contact.impulse == 0:
                return 0.0, 0.0
            n, u = contact.normal, self.risen(contact)
            wanted = contact.kick + (contact.rebound - n @ (contact.moved + u)) / (n @ self.answer(contact) @ n)
            kick = min(np.inf if contact.rebound > 0 else 0.0, max(-contact.impulse, wanted))
            change, contact.kick = kick - contact.kick, kick
            self.strike(contact, change * n)
            if kick > 0:
                self.strike(contact, self.gripped(contact, contact.impulse + kick, contact.moved + u))
            return abs(change), contact.impulse

        self.iterate(once)
        for p in self.particles:
            self.twin.previous[p] -= self.shift + np.cross(self.turn, self.twin.x[p] - self.centre)
