"""The colliders of a scene, immovable or on a given path, one model a kind."""

from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from .schema_common import (
    Direction,
    Fraction,
    Friction,
    Length,
    Name,
    Part,
    Rotation,
    Sides,
    Spin,
    Trajectory,
    Vector,
)


class BaseCollider(Part):
    """What all colliders have."""

    name: Name = Field(default="", description="how paths call it; KIND_INDEX if left out, such as plane_0")
    path: Trajectory | None = Field(
        default=None, description="rows [t, x, y, z] (s, m): carried along by path(t) - path(first), straight from "
                                  "row to row")
    spin: Spin | None = Field(default=None, description="steady turn about an axis through its position")
    friction: Friction | None = Field(
        default=None, description="{static, dynamic} or one number for both; that of `effects` if left out")
    restitution: Fraction | None = Field(
        default=None, description="part of the normal speed that an impact gives back; that of `effects` if left out")

    @model_validator(mode="before")
    @classmethod
    def _start_on_path(cls, written: Any) -> Any:
        place = "point" if "point" in cls.model_fields else "position"
        path = written.get("path") if isinstance(written, dict) else None
        if isinstance(path, list | tuple) and path and place not in written and isinstance(path[0], list | tuple):
            return {**written, place: path[0][1:]}
        return written


class PlaneCollider(BaseCollider):
    """A half space: everything behind the plane is solid."""

    kind: Literal["plane"]
    point: Vector = Field(default=(0.0, 0.0, 0.0), description="any point of the plane, m")
    normal: Direction = Field(
        default=(0.0, 0.0, 1.0), description="points to the free side; its length does not matter")


class RoomCollider(BaseCollider):
    """A box seen from inside: everything outside is solid."""

    kind: Literal["room"]
    size: Sides = Field(description="sides along x, y and z, m")
    position: Vector = Field(default=(0.0, 0.0, 0.0), description="centre, m")


class BoxCollider(BaseCollider):
    """A solid box."""

    kind: Literal["box"]
    size: Sides = Field(description="sides along x, y and z, m")
    position: Vector = Field(default=(0.0, 0.0, 0.0), description="centre, m")


class SphereCollider(BaseCollider):
    """A solid sphere."""

    kind: Literal["sphere"]
    radius: Length = Field(description="m")
    position: Vector = Field(default=(0.0, 0.0, 0.0), description="centre, m")


class CylinderCollider(BaseCollider):
    """A solid cylinder with flat ends."""

    kind: Literal["cylinder"]
    radius: Length = Field(description="m")
    axis: Direction = Field(default=(0.0, 0.0, 1.0), description="along the cylinder; its length does not matter")
    position: Vector = Field(default=(0.0, 0.0, 0.0), description="centre, m")
    length: Length = Field(description="from end to end, m")


class MeshCollider(BaseCollider):
    """A solid from a file of triangles; the file's origin is put at its position."""

    kind: Literal["mesh"]
    file: Annotated[str, Field(min_length=1, max_length=4096)] = Field(
        description="file of triangles (OBJ, STL, PLY, OFF ...), relative to the scene file")
    scale: Length = Field(default=1.0, description="factor from the file's unit to m")
    position: Vector = Field(default=(0.0, 0.0, 0.0), description="where the file's origin is put, m")
    rotation: Rotation | None = Field(default=None, description="turn about the file's origin")


Collider = Annotated[
    PlaneCollider | RoomCollider | BoxCollider | SphereCollider | CylinderCollider | MeshCollider,
    Field(discriminator="kind")]
COLLIDERS: dict[str, type[BaseCollider]] = {
    "plane": PlaneCollider, "room": RoomCollider, "box": BoxCollider, "sphere": SphereCollider,
    "cylinder": CylinderCollider, "mesh": MeshCollider}
