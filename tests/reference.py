"""A naive twin of the simulator: one substep after another, particle by particle in the order of the file, in numpy.

Here are forces and the frame; constraints stand in reference_constraints.py, colliders and contacts in reference_contact.py.

It knows no groups, runs or blocks and shares no formula with the package: it is written from the equations, to be
read beside them. Slow, in double precision, without care for degenerate cases.
"""

import itertools
from dataclasses import dataclass, field

import numpy as np
from reference_constraints import Stick, chains, relax_angle, relax_pieces, relax_stick, relaxation_order
from reference_contact import Whole, find_contact, held, impact, on_path, solids

# --- Forces -----------------------------------------------------------------------------------------------------------

def joined(values):
    return np.concatenate(list(values)).astype(float)


def path_slope(path):
    """Velocity with which a path begins, if it begins at time 0."""
    if path is None or len(path) < 2 or path[0, 0] > 0:
        return np.zeros(3)
    return (path[1, 1:] - path[0, 1:]) / (path[1, 0] - path[0, 0])


def wind_force(corners, velocities, wind, density, inverse_masses=(0.0,), h=0.0):
    """Force [N] on a triangle: density/2 area |u.n| (u.n) n, over 1 + k h/2 where six of them slow the lightest corner by k."""
    cross = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    area, normal = np.linalg.norm(cross) / 2, cross / np.linalg.norm(cross)
    along = (wind - np.mean(velocities, axis=0)) @ normal
    k = 6 * density / 2 * area * abs(along) / 3 * max(inverse_masses)
    return density / 2 * area * abs(along) * along * normal / (1 + k * h / 2)


def with_drag(a, displacement, air, linear, quadratic, h):
    """Acceleration with drag at the velocity of the central difference; its speed by one fixed-point step."""
    v = displacement / h
    for _ in range(2):
        k = linear + quadratic * np.linalg.norm(v - air)
        # solves b = a - k (displacement/h + b h/2 - air) for b
        b = (a - k * displacement / h + k * air) / (1 + k * h / 2)
        v = displacement / h + b * h / 2
    return b


def with_damping(a, displacement, rate, h):
    """The a' for which displacement + a' h^2 is the exact next displacement of v' = a - rate v."""
    if rate == 0:
        return a
    decay = np.exp(-rate * h)
    return (displacement * (decay - 1) + a * h / rate * (1 - decay)) / h**2


# --- The whole --------------------------------------------------------------------------------------------------------

@dataclass
class Twin:
    """A scene and its bodies, simulated naively. x, previous: (N, 3) m in the order of the file.

    Bodies do not meet each other here, nor rigid ones other colliders than planes and rooms.
    """

    scene: object
    bodies: list
    number: int = 0                     # substeps done
    contacts: list = field(default_factory=list)
    relaxed: int = 0

    def __post_init__(self):
        scene, bodies = self.scene, self.bodies
        self.h = 1 / (scene.time.frame_rate * scene.solver.substeps)
        per_copy = [(body, copy) for body in bodies for copy in range(body.copies)]
        sizes = [len(body.pinned) for body, _ in per_copy]
        self.first = dict(zip([(id(body), copy) for body, copy in per_copy], np.cumsum([0, *sizes[:-1]]), strict=True))
        self.x = joined(body.positions[copy] for body, copy in per_copy)
        self.start = self.x.copy()
        self.mass = joined(body.shape.masses for body, _ in per_copy)
        self.free = ~joined(body.pinned for body, _ in per_copy).astype(bool)
        self.w = np.where(self.free, 1 / self.mass, 0.0)
        self.radius = joined(np.full(len(body.pinned), body.shape.radius) for body, _ in per_copy)
        self.owner = [body for body, _ in per_copy for _ in range(len(body.pinned))]
        velocity = joined(body.velocities[copy] for body, copy in per_copy) * self.free[:, None]
        self.solids = [solid for collider in scene.colliders for solid in solids(collider)]
        if scene.effects.contact == "none":
            self.solids = []
        self.find_constraints(per_copy)
        self.whole = [Whole(self, self.first[id(body), copy] + np.arange(len(body.pinned))) for body, copy in per_copy
                      if body.shape.rigid and not body.pinned.any()]
        slopes = joined(np.broadcast_to(path_slope(body.path), body.positions[copy].shape) for body, copy in per_copy)
        self.given = np.where(self.free[:, None], velocity, slopes)
        self.previous = self.x - velocity * self.h
        self.previous = self.x - velocity * self.h + self.acceleration() * self.h**2 / 2

    def find_constraints(self, per_copy):
        self.sticks, self.angles, self.triangles, self.chains, self.observed = [], [], [], [], []
        chained = self.scene.solver.order == "lines"
        for body, copy in per_copy:
            first, shape = self.first[id(body), copy], body.shape
            order = relaxation_order(shape)
            sticks = {c: Stick(*(first + shape.sticks[c]), shape.lengths[c], shape.compliance) for c in order}
            self.observed += sticks.values()
            for chain in chains(shape)[0] if chained else []:
                self.chains.append([sticks.pop(c) for c in chain])
            self.sticks += sticks.values()
            self.angles += [(first + corners, rest) for corners, rest in zip(shape.angles, shape.angle_values, strict=True)]
            self.triangles += list(first + shape.triangles)
        start = {body.name: self.first[id(body), 0] for body in self.bodies}
        self.sticks += [Stick(start[a] + i, start[b] + j, 0.0, 0.0) for a, i, b, j in self.scene.attachments]
        rests = [stick.rest for stick in self.observed if stick.rest > 0]
        self.margin = 0.05 * min(rests, default=0.0)

    def acceleration(self):
        effects, h = self.scene.effects, self.h
        displacement = self.x - self.previous
        a = np.zeros_like(self.x)
        if effects.gravity:
            a[self.free] = effects.gravity
        air = np.zeros(3)
        if effects.wind:
            air = np.array(effects.wind.velocity)
            for triangle in self.triangles:
                force = wind_force(self.x[triangle], displacement[triangle] / h, air, effects.wind.density, self.w[triangle], h)
                for p in triangle:
                    a[p] += force / 3 * self.w[p]
        for p in np.flatnonzero(self.free):
            if effects.drag:
                a[p] = with_drag(a[p], displacement[p], air, effects.drag.linear, effects.drag.quadratic, h)
            if effects.damping:
                a[p] = with_damping(a[p], displacement[p], effects.damping, h)
        return a

    def substep(self):
        h, t, solver = self.h, self.number * self.h, self.scene.solver
        a = self.acceleration()
        self.x, self.previous = 2 * self.x - self.previous + a * h**2, self.x
        self.carry(t + h)
        found = (find_contact(k, self.x[k], self.previous[k], self.radius[k], solid, self.margin, t, h)
                 for solid in self.solids for k in np.flatnonzero(self.free) if self.meets(k, solid))
        self.contacts = [contact for contact in found if contact]
        for body in self.whole:
            body.gather()
        self.foresee(a)
        for stick in itertools.chain(self.sticks, *self.chains):
            stick.multiplier = 0.0
        for iteration in range(solver.iterations):
            self.separate()
            for body in self.whole:
                body.separate(first=iteration == 0)
            for chain in self.chains:
                self.relaxed += relax_pieces(self.x, self.w, chain, h, solver.tolerance, solver.square_root == "approximate",
                                             self.owner[chain[0].i].shape.layout[0] != "grid")[0]
            for stick in self.sticks:
                self.relaxed += relax_stick(self.x, self.w, stick, h, solver.tolerance, solver.square_root == "approximate")
            for corners, rest in self.angles:
                relax_angle(self.x, self.w, corners, rest)
                self.relaxed += 1
        self.bounce()
        for body in self.whole:
            body.keep()
            body.rebound()
        self.rub()
        self.number += 1

    def meets(self, k, solid):
        """Whether a particle meets a solid by itself: rigid bodies meet all but planes with their hulls."""
        return not self.owner[k].shape.rigid or solid.collider.kind in ("plane", "room")

    def carry(self, t):
        for p, body in enumerate(self.owner):
            if not self.free[p]:
                self.x[p] = self.start[p]
                if body.path is not None:
                    self.x[p] += on_path(body.path, t) - body.path[0, 1:]

    def alone(self):
        """Contacts of particles that answer alone, not as part of a rigid body."""
        return [contact for contact in self.contacts if not any(contact.k in body.particles for body in self.whole)]

    def separate(self):
        for contact in self.alone():
            push = max(0.0, contact.push - contact.height(self.x))
            self.x[contact.k] += (push - contact.push) * contact.normal
            contact.push = push

    def foresee(self, a):
        for contact in self.contacts:
            of_solid = contact.solid.collider.restitution
            if of_solid is None:
                of_solid = self.scene.effects.restitution or 0.0
            e, after = max(self.owner[contact.k].restitution, of_solid), contact.height(self.x)
            if e > 0 and after < 0:
                before = max(0.0, after - contact.approach(self.x))
                gap, contact.rebound = impact(before, after, contact.normal @ a[contact.k], self.h, e)
                contact.bound += gap

    def bounce(self):
        for contact in self.alone():
            if contact.rebound > 0 and contact.push > 0:
                excess = contact.approach(self.x) - contact.rebound
                contact.push += max(0.0, -excess)
                self.previous[contact.k] += excess * contact.normal

    def rub(self):
        for contact in self.alone():
            if contact.push > 0:
                slide = contact.slide(self.x[contact.k])
                self.x[contact.k] -= slide * held(np.linalg.norm(slide), contact.push, *self.friction(contact))

    def friction(self, contact):
        """Static and dynamic coefficient of a contact."""
        of_solid, of_body = contact.solid.collider.friction or self.scene.effects.friction, self.owner[contact.k].friction
        return (np.sqrt(of_body[0] * of_solid.static), np.sqrt(of_body[1] * of_solid.dynamic)) if of_solid else (0.0, 0.0)

    def frames(self, count):
        """The first `count` frames: positions and velocities (F, N, 3) and a dictionary of measures (F, ...) ."""
        shown = [self.frame(after=self.scene.solver.substeps if f else 0) for f in range(count)]
        x, _, counts = shown[0]
        shown[0] = x, self.given, counts | self.measures(x, self.given, 0.0)
        positions, velocities, measures = zip(*shown, strict=True)
        return np.array(positions), np.array(velocities), {key: np.array([m[key] for m in measures]) for key in measures[0]}

    def frame(self, after):
        """The frame so many substeps from the last. One more substep gives its velocities; that one stays done."""
        for _ in range(after - 1):
            self.substep()
        x, before, t = self.x.copy(), self.previous.copy(), self.number * self.h
        touching, relaxed, self.relaxed = sum(contact.push > 0 for contact in self.contacts), self.relaxed, 0
        self.substep()
        v = (self.x - before) / (2 * self.h)
        return x, v, self.measures(x, v, t) | {"contacts": touching, "relaxations": relaxed, "fallbacks": 0}

    def measures(self, x, v, t):
        m = self.mass[:, None]
        gravity = np.array(self.scene.effects.gravity or (0.0, 0.0, 0.0))
        errors = [np.linalg.norm(x[s.j] - x[s.i]) / s.rest - 1 for s in self.observed if s.rest > 0]
        inside = [self.radius[k] - solid.distance(R.T @ (x[k] - o))[0] for solid in self.solids
                  for o, R in [solid.pose(t)] for k in np.flatnonzero(self.free) if self.meets(k, solid)]
        kinetic, potential = (m * v**2).sum() / 2, -(m * x * gravity).sum()
        return {"kinetic_energy": kinetic, "potential_energy": potential, "total_energy": kinetic + potential,
                "momentum": (m * v).sum(0), "angular_momentum": (m * np.cross(x, v)).sum(0),
                "centre_of_mass": (m * x).sum(0) / m.sum(), "constraint_error_max": np.abs(errors).max(initial=0.0),
                "constraint_error_rms": np.sqrt(np.mean(np.square(errors))) if errors else 0.0,
                "penetration_max": max([0.0, *inside]), "speed_max": np.linalg.norm(v, axis=1).max()}
