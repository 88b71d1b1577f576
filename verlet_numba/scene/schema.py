"""What a scene file may say: every key, its meaning, unit, bounds and default."""

from collections.abc import Iterable
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from .schema_bodies import Body
from .schema_colliders import Collider
from .schema_common import Finding, Integer, Name, Number, Part, Switch, Thickness, Whole, named
from .schema_effects import Effects

Count = Annotated[Integer, Field(ge=1, le=100_000)]
Seconds = Annotated[Number, Field(ge=0, le=1e9)]
Recorded = Literal[
    "kinetic_energy", "potential_energy", "total_energy", "momentum", "angular_momentum", "centre_of_mass",
    "constraint_error_max", "constraint_error_rms", "penetration_max", "contacts", "relaxations", "fallbacks",
    "resting", "speed_max"]
Measure = Literal[Recorded, "rest_time", "orientation_flips", "self_intersections", "outside"]
Component = Literal["momentum.x", "momentum.y", "momentum.z", "angular_momentum.x", "angular_momentum.y", "angular_momentum.z",
                    "centre_of_mass.x", "centre_of_mass.y", "centre_of_mass.z"]

COUNTED = ("contacts", "relaxations", "fallbacks", "resting")
"""Measures that a run counts for the whole scene."""

MAX_FRAMES = 100_000_000

PAPER: dict[str, Any] = {
    "substeps": 1, "iterations": 10, "tolerance": 0.01, "order": "constraint_graph", "repeats": "by_level",
    "response": "feature", "projection_point": "feature", "deformable_contact": "spheres", "orientation_guard": False,
    "gradient": "current", "square_root": "approximate", "precision": "float64", "broad_phase": "all_pairs"}
"""Solver settings of Ponce Atencio et al. 2005."""


class Time(Part):
    """How long, and how finely, the scene is simulated. The step is 1/(frame_rate * substeps)."""

    duration: Seconds = Field(description="simulated time, s")
    frame_rate: Annotated[Number, Field(ge=1e-3, le=1e6)] = Field(
        default=60.0, description="recorded frames a second, 1/s")

    def findings(self) -> Iterable[Finding]:
        if self.duration * self.frame_rate > MAX_FRAMES:
            frames = self.duration * self.frame_rate
            yield ("duration",), f"makes {frames:.3g} frames; at most {MAX_FRAMES:,} are possible"


class Solver(Part):
    """How constraints and contacts are solved. Keys that are left out follow the preset."""

    preset: Literal["default", "paper"] = Field(
        default="default", description="values of the keys that are left out; `paper`, the method of Ponce Atencio et "
        "al. 2005: " + ", ".join(f"{key} {value}" for key, value in PAPER.items()))
    substeps: Count = Field(default=8, description="steps a frame")
    iterations: Count = Field(default=1, description="passes over all constraints a substep")
    tolerance: Annotated[Number, Field(ge=0, lt=1)] = Field(
        default=0.0, description="relative; a constraint within it is left alone")
    order: Literal["sequential", "constraint_graph", "lines"] = Field(
        default="sequential", description="order of the constraints. `constraint_graph`: of rigid bodies from the "
        "particle moved most; `lines`: rows, columns, diagonals and chains as tridiagonal systems")
    repeats: Literal["by_level", "halving", "once"] = Field(
        default="by_level", description="how often `constraint_graph` solves a stick, by its distance from the moved "
                                        "particle: n/k rounded up, halved each level, or once")
    response: Literal["body", "feature"] = Field(
        default="body", description="contacts of rigid bodies move whole bodies, with as many contacts "
                                    "as edges and faces need; or only the features that touch, one contact a pair")
    projection_point: Literal["feature", "body", "printed"] = Field(
        default="feature", description="where two features meet: by their own masses, by those of the "
                                       "bodies, or by those the wrong way round, as eq. 10 of the paper is printed")
    deformable_contact: Literal["exact", "spheres"] = Field(
        default="spheres", description="contacts of cloth and ropes: vertex-triangle and edge-edge, or spheres "
                                       "about the particles")
    orientation_guard: Switch = Field(
        default=False, description="whether rigid bodies that were turned inside out are restored")
    gradient: Literal["current", "step_start"] = Field(
        default="current", description="direction of a stick's correction: the present one, or that at the start of "
                                       "the step, second order; of bodies that are hit or turn fast the present one")
    square_root: Literal["exact", "approximate"] = Field(
        default="exact", description="`approximate`: one Newton step from the rest length (Jakobsen 2001)")
    precision: Literal["float64", "float32"] = Field(default="float64", description="of the simulation")
    broad_phase: Literal["sweep", "all_pairs"] = Field(
        default="sweep", description="how pairs of rigid bodies that may touch are found: `sweep` through a "
                                      "hierarchy of grids")

    def findings(self) -> Iterable[Finding]:
        if self.gradient == "step_start" and self.order != "sequential":
            yield ("gradient",), f"step_start is for order sequential, not for {self.order}: use `current`, or another order"

    @model_validator(mode="before")
    @classmethod
    def _fill_from_preset(cls, written: Any) -> Any:
        if isinstance(written, dict) and written.get("preset") == "paper":
            return {**PAPER, **written}
        return written


DEFAULT: dict[str, Any] = {key: field.default for key, field in Solver.model_fields.items() if key != "preset"}
"""Solver settings of preset `default`."""


class Output(Part):
    """What the trajectory file holds beside the positions."""

    fields: tuple[Literal["velocity"], ...] = Field(default=(), description="per particle, beside the positions")
    observables: Switch = Field(default=True, description="whether energies, momenta, errors and counts are recorded")
    precision: Literal["float32", "float64"] = Field(
        default="float32", description="of positions and fields in the file")
    precision_bits: Annotated[Integer, Field(ge=1, le=24)] = Field(
        default=24, description="bits of the mantissa that are kept; 23 and fewer round, and compress better")


class Expect(Part):
    """A bound that a measure has to keep in every frame of [from, to]; exactly one of max, min, equal."""

    measure: Literal[Measure, Component] = Field(
        description="what is measured; of vectors their length, with .x, .y or .z behind the name that component")
    max: Number | None = Field(default=None, description="upper bound, in the measure's unit")
    min: Number | None = Field(default=None, description="lower bound, in the measure's unit")
    equal: Number | None = Field(default=None, description="value, in the measure's unit")
    tolerance: Thickness = Field(default=0.0, description="by which the bound may be missed, in the measure's unit")
    start: Seconds = Field(default=0.0, alias="from", description="first time, s")
    end: Seconds | None = Field(default=None, alias="to", description="last time, s; the end of the run if left out")
    body: Name | None = Field(
        default=None, description="the body that is measured, all its copies; the whole scene if left out. Of a body "
                                  "penetration_max tells how deep its particles are in colliders")

    def findings(self) -> Iterable[Finding]:
        bounds = [key for key in ("max", "min", "equal") if getattr(self, key) is not None]
        if len(bounds) != 1:
            yield (), f"needs exactly one of max, min and equal, but has {' and '.join(bounds) or 'none'}"
        if self.end is not None and self.end < self.start:
            yield ("to",), f"{self.end:g} s is before `from`, {self.start:g} s"
        if self.body is not None and self.measure in COUNTED:
            yield ("body",), f"{self.measure} is counted for the whole scene, not for a body"


class Reference(Part):
    """A closed form that `accuracy` measures error against."""

    measure: Literal[Recorded, Component, "rest_time"] = Field(
        description="what is measured at the end of the run; of vectors their length, or a component as in `expect`")
    value: Number = Field(description="its true value, in the measure's unit")
    source: str = Field(default="", description="where the value comes from", max_length=10_000)


Attachment = tuple[Name, Whole, Name, Whole]


class Scene(Part):
    """A scene of verlet-numba: SI units, z up."""

    version: Literal[1] = Field(description="version of the format of scene files: 1")
    name: Annotated[str, Field(max_length=1000)] = Field(default="scene", description="title")
    time: Time = Field(description="duration and frame rate")
    seed: Whole = Field(default=0, description="of everything random")
    solver: Solver = Field(default=Solver(), description="how constraints and contacts are solved")
    effects: Effects = Field(
        default=Effects(gravity=(0.0, 0.0, -9.81)),
        description="forces and materials; if left out altogether, gravity and contact")
    bodies: Annotated[tuple[Body, ...], BeforeValidator(named), Field(max_length=100_000)] = Field(
        default=(), description="what moves, in the order of the trajectory file")
    attachments: tuple[Attachment, ...] = Field(
        default=(), description="rows [body, particle, body, particle]: the two stay together; copies of a body "
                                "count on: particle p of copy k is number k * particles + p")
    colliders: Annotated[tuple[Collider, ...], BeforeValidator(named), Field(max_length=100_000)] = Field(
        default=(), description="what bodies meet but never move")
    output: Output = Field(default=Output(), description="what the trajectory file holds")
    expect: tuple[Expect, ...] = Field(default=(), description="what `verify` holds a run against")
    reference: Reference | None = Field(default=None, description="closed form for `accuracy`")
