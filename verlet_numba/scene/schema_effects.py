"""The effects of a scene: forces, materials and what else is compiled only when a scene calls for it."""

from typing import Annotated, Literal

from pydantic import Field

from .schema_common import Fraction, Friction, Number, Part, Speed, Switch, Vector

Rate = Annotated[Number, Field(ge=0, le=1e9)]


class Drag(Part):
    """Deceleration against the velocity relative to the wind: linear u + quadratic |u| u."""

    linear: Rate = Field(default=0.0, description="1/s")
    quadratic: Rate = Field(default=0.0, description="1/m")


class Wind(Part):
    """Force on every triangle, u its velocity relative to the wind: density/2 * area * |u.n| (u.n) n, against u."""

    velocity: Vector = Field(description="m/s")
    density: Rate = Field(default=1.2, description="of the air, kg/m^3")


class Bending(Part):
    """Resistance of cloth and ropes to bending: angles return to those of the start as critically damped springs."""

    stiffness: Fraction = Field(
        description="part of an angle's error, from rest, that is removed in a frame, whatever the substeps and passes")


class Rest(Part):
    """Bodies that stay slow are put to rest until something touches them."""

    speed: Speed = Field(default=0.01, description="below which a body counts as slow, m/s")
    time: Annotated[Number, Field(ge=0, le=1e9)] = Field(default=0.5, description="for which it has to be slow, s")


class Effects(Part):
    """Only what stands here, or what bodies and colliders imply, is compiled and run; {} has no gravity."""

    gravity: Vector | None = Field(
        default=None, description="acceleration of all free particles, m/s^2; [0, 0, -9.81] if the scene has no "
                                  "`effects` at all (an override of another effect keeps it), none if it has and this is left out")
    contact: Literal["auto", "none"] = Field(
        default="auto", description="`auto`: between bodies, colliders and each other wherever the scene has them")
    drag: Drag | None = Field(default=None, description="resistance of the medium")
    damping: Annotated[Number, Field(ge=0, le=1e9)] | None = Field(
        default=None, description="1/s: velocity decays as exp(-damping t)")
    wind: Wind | None = Field(default=None, description="moving air; drag acts on the velocity relative to it")
    friction: Friction | None = Field(
        default=None, description="{static, dynamic} or one number for both, of all bodies and colliders that set "
                                  "none")
    restitution: Fraction | None = Field(
        default=None, description="part of the normal speed that an impact gives back, of all bodies and colliders "
                                  "that set none; two materials meet with the larger one. Rigid bodies rebound "
                                  "from planes and rooms, particles from all colliders")
    self_collision: Switch = Field(
        default=False, description="whether cloth, ropes and bodies of particles meet themselves, as spheres of their thickness")
    continuous_collision: Switch = Field(default=False, description="whether contacts are sought along the whole step")
    bending: Bending | None = Field(default=None, description="resistance to bending")
    rest: Rest | None = Field(default=None, description="when bodies are put to rest")


