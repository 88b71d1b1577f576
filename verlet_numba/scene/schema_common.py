"""Quantities that all parts of a scene share: numbers with bounds, vectors, rotations, paths, materials.

Bounds keep mistakes and hostile input harmless; no sensible scene comes near them. Lengths are in m, masses in kg,
times in s, angles in degrees where the name says so and in rad otherwise.
"""

from collections.abc import Iterable, Mapping
from itertools import pairwise
from typing import Annotated, Any, Self

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, model_validator
from pydantic_core import PydanticCustomError

from .problems import Path

Finding = tuple[Path, str]
"""What is wrong, and the path to it within the part that is looked at."""

def _whole(value: Any) -> Any:
    """A number such as 1e3 is whole too."""
    return int(value) if isinstance(value, float) and value.is_integer() else value


Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Coordinate = Annotated[Number, Field(ge=-1e9, le=1e9)]
Length = Annotated[Number, Field(gt=0, le=1e9)]
Thickness = Annotated[Number, Field(ge=0, le=1e9)]
Speed = Annotated[Number, Field(ge=0, le=1e9)]
Integer = Annotated[int, Field(strict=True, le=2**62), BeforeValidator(_whole)]
Whole = Annotated[Integer, Field(ge=0)]
Switch = Annotated[bool, Field(strict=True)]
Fraction = Annotated[Number, Field(ge=0, le=1)]

Vector = tuple[Coordinate, Coordinate, Coordinate]
Sides = tuple[Length, Length, Length]
Instant = Annotated[Number, Field(ge=0, le=1e9)]
Waypoint = tuple[Instant, Coordinate, Coordinate, Coordinate]

Name = Annotated[str, Field(pattern=r"^[^.=/\s]*[^.=/\s\d][^.=/\s]*$", max_length=200)]
"""Names stand in paths such as `bodies.NAME.mass`, so they hold no dot, slash, = or space, and are no mere number."""


def _directed(vector: Vector) -> Vector:
    if not any(vector):
        raise PydanticCustomError("direction", "has no direction: at least one component must not be 0")
    return vector


def _rising(path: tuple[Waypoint, ...]) -> tuple[Waypoint, ...]:
    for row, (before, after) in enumerate(pairwise(path), start=1):
        if after[0] <= before[0]:
            raise findings_error([((row, 0), f"times must rise: {after[0]:g} s follows {before[0]:g} s")])
    return path


def _invertible(mass: float) -> float:
    if mass < 1e-30:
        raise PydanticCustomError("mass", "is too small to be a mass: it must be at least 1e-30")
    return mass


Mass = Annotated[Number, Field(gt=0, le=1e30), AfterValidator(_invertible)]
def _comparable(length: float) -> float:
    if 0 < length < 1e-30:
        raise PydanticCustomError("length", "is too small to be a length: it must be 0, or at least 1e-30")
    return length


StickLength = Annotated[Thickness, AfterValidator(_comparable)]
Direction = Annotated[Vector, AfterValidator(_directed)]
Trajectory = Annotated[tuple[Waypoint, ...], Field(min_length=1), AfterValidator(_rising)]


def findings_error(findings: Iterable[Finding]) -> PydanticCustomError:
    """What a validator raises to place several findings within the part that it looked at."""
    found = list(findings)
    return PydanticCustomError("findings", "{text}", {"text": "; ".join(m for _, m in found), "findings": found})


class Part(BaseModel):
    """A mapping of a scene: frozen, without unknown keys. Checks across its keys stand in `findings`."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    def findings(self) -> Iterable[Finding]:
        """What is wrong between keys that are each right."""
        return ()

    @model_validator(mode="after")
    def _check(self) -> Self:
        found = list(self.findings())
        if found:
            raise findings_error(found)
        return self


class Rotation(Part):
    """A turn by `degrees` about `axis`, counter-clockwise seen from the tip of the axis."""

    axis: Direction = Field(description="axis of the turn; its length does not matter")
    degrees: Coordinate = Field(description="angle of the turn, degrees")


class Spin(Part):
    """A steady turn about an axis through the position."""

    axis: Direction = Field(description="axis of the turn; its length does not matter")
    rate: Coordinate = Field(description="rad/s")


class FrictionPair(Part):
    """Coulomb friction. Two materials a, b meet with sqrt(a b)."""

    static: Annotated[Number, Field(ge=0, le=1e3)] = Field(description="coefficient that holds a contact at rest")
    dynamic: Annotated[Number, Field(ge=0, le=1e3)] = Field(
        description="coefficient of a sliding contact, at most `static`")

    def findings(self) -> Iterable[Finding]:
        if self.dynamic > self.static:
            yield ("dynamic",), f"{self.dynamic:g} is above static friction ({self.static:g}); it must be at most that"


def _both(value: Any) -> Any:
    if isinstance(value, int | float) and not isinstance(value, bool):
        return {"static": value, "dynamic": value}
    return value


Friction = Annotated[FrictionPair, BeforeValidator(_both, json_schema_input_type=float | FrictionPair)]
"""{static, dynamic}, or one number for both."""


def entry_name(entry: Any, index: int) -> str | None:
    """The name of a body or collider as written: its `name`, else KIND_INDEX. None if it has neither name nor kind."""
    if not isinstance(entry, Mapping):
        return None
    name, kind = entry.get("name"), entry.get("kind")
    if isinstance(name, str):
        return name
    return f"{kind}_{index}" if name is None and isinstance(kind, str) else None


def named(entries: Any) -> Any:
    """The entries as written, those without a name named KIND_INDEX."""
    if not isinstance(entries, list | tuple):
        return entries
    names = [entry_name(entry, index) for index, entry in enumerate(entries)]
    return [entry if name is None else {**entry, "name": name} for entry, name in zip(entries, names, strict=True)]
