"""A trajectory as USD, by its own library (usd-core): bodies as meshes, curves and points that move, solid colliders."""

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from verlet_numba.study.export import ExportError, Part, frame_rate, parts
from verlet_numba.study.reader import Array, Trajectory
from verlet_numba.study.render import View
from verlet_numba.study.surfaces import COLLIDER, PALETTE, placed, radii


class Moving(NamedTuple):
    """A prim of points and the particles (n,) that they are."""

    prim: Any
    particles: Array


def write_usd(trajectory: Trajectory, frames: list[int], file: Path) -> None:
    """Write frames as time samples: time code k is frame k of the trajectory. Metres, z up.

    Velocities are written where the trajectory has them. Raises ImportError without usd-core, ExportError for what its
    library cannot write.
    """
    from pxr import Tf, Usd, UsdGeom

    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    rate = frame_rate(trajectory)
    stage.SetTimeCodesPerSecond(rate)
    stage.SetFramesPerSecond(rate)
    stage.SetStartTimeCode(min(frames))
    stage.SetEndTimeCode(max(frames))
    stage.SetDefaultPrim(UsdGeom.Xform.Define(stage, "/world").GetPrim())
    stage.GetRootLayer().comment = f"{trajectory.path.name}: {trajectory.scene.get('name') or 'a scene'}"
    view = View(trajectory, 560, 420)
    moving = define_bodies(stage, trajectory, view.scale)
    for frame in frames:
        sample(moving, frame, trajectory.positions(frame), trajectory.velocities(frame))
    define_colliders(stage, trajectory, view, frames)
    try:
        stage.GetRootLayer().Export(str(file))
    except Tf.ErrorException as error:
        raise ExportError(f"{file}: cannot be written ({error})") from error


def define_bodies(stage: Any, trajectory: Trajectory, scale: float) -> list[Moving]:
    """/world/NAME with `surface`, `lines` and `points`, as far as the body has them, without positions yet."""
    from pxr import UsdGeom

    line_radius, dot_radius = radii(trajectory, scale)
    names = identifiers([body.name for body in trajectory.bodies])
    found = []
    for number, part in enumerate(parts(trajectory)):
        path, own = f"/world/{names[number]}", np.arange(part.first, part.end)
        prim = UsdGeom.Xform.Define(stage, path).GetPrim()
        prim.SetDisplayName(part.name)
        prim.SetCustomDataByKey("mass", trajectory.bodies[number].mass)        # kg
        shapes = []
        if len(part.triangles):
            shapes.append(Moving(mesh(stage, f"{path}/surface", part.triangles - part.first), own))
        if part.lines:
            shapes.append(Moving(curves(stage, f"{path}/lines", part, 2 * line_radius[number]), np.concatenate(part.lines)))
        loose = own if trajectory.bodies[number].kind == "particles" else part.points
        if len(loose):
            shapes.append(Moving(balls(stage, f"{path}/points", 2 * dot_radius[number]), loose))
        for shape in shapes:
            shape.prim.CreateDisplayColorAttr([tuple(PALETTE[number % len(PALETTE)].tolist())])
        found += shapes
    return found


def mesh(stage: Any, path: str, triangles: Array) -> Any:
    """Triangles (F, 3) as a mesh that is not smoothed and is seen from both sides."""
    from pxr import UsdGeom, Vt

    made = UsdGeom.Mesh.Define(stage, path)
    made.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(triangles), 3, np.int32)))
    made.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(triangles.ravel().astype(np.int32)))
    made.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    made.CreateDoubleSidedAttr(True)
    return made


def curves(stage: Any, path: str, part: Part, width: float) -> Any:
    """Polylines as linear curves, of which every one has points of its own."""
    from pxr import UsdGeom

    made = UsdGeom.BasisCurves.Define(stage, path)
    made.CreateTypeAttr(UsdGeom.Tokens.linear)
    made.CreateCurveVertexCountsAttr([len(line) for line in part.lines])
    made.CreateWidthsAttr([width])
    made.SetWidthsInterpolation(UsdGeom.Tokens.constant)
    return made


def balls(stage: Any, path: str, width: float) -> Any:
    """Points drawn as balls of one diameter."""
    from pxr import UsdGeom

    made = UsdGeom.Points.Define(stage, path)
    made.CreateWidthsAttr([width])
    made.SetWidthsInterpolation(UsdGeom.Tokens.constant)
    return made


def sample(moving: list[Moving], frame: int, positions: Array, velocities: Array | None) -> None:
    """Points, their bounds and velocities at a time code."""
    from pxr import Vt

    for prim, particles in moving:
        points = positions[particles].astype(np.float32)
        prim.GetPointsAttr().Set(Vt.Vec3fArray.FromNumpy(points), frame)
        prim.GetExtentAttr().Set(Vt.Vec3fArray.FromNumpy(np.stack([points.min(axis=0), points.max(axis=0)])), frame)
        if velocities is not None:
            prim.GetVelocitiesAttr().Set(Vt.Vec3fArray.FromNumpy(velocities[particles].astype(np.float32)), frame)


def define_colliders(stage: Any, trajectory: Trajectory, view: View, frames: list[int]) -> None:
    """/world/colliders/NAME: boxes, spheres, cylinders and meshes, placed by a matrix, of those that move by one a frame."""
    from pxr import Gf, Vt

    names = identifiers([entry.get("name") or f"{entry['kind']}_{k}" for k, entry in enumerate(view.colliders)])
    for name, collider, triangles in zip(names, view.colliders, view.solids, strict=True):
        if not len(triangles):
            continue
        points, corners = np.unique(triangles.reshape(-1, 3).round(9), axis=0, return_inverse=True)
        made = mesh(stage, f"/world/colliders/{name}", corners.reshape(-1, 3))
        made.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(points.astype(np.float32)))
        made.CreateExtentAttr(Vt.Vec3fArray.FromNumpy(np.stack([points.min(axis=0), points.max(axis=0)]).astype(np.float32)))
        made.CreateDisplayColorAttr([COLLIDER])
        transform = made.AddTransformOp()
        moves = collider.get("path") or collider.get("spin")
        for frame in frames if moves else frames[:1]:
            place = placed(collider, float(trajectory.time[frame]))
            matrix = np.eye(4)
            matrix[:3, :3], matrix[3, :3] = place.rotation.T, place.origin       # USD's vectors are rows
            transform.Set(Gf.Matrix4d(matrix.tolist()), *([frame] if moves else []))


def identifiers(names: list[str]) -> list[str]:
    """Names as USD allows them, each different from all others."""
    from pxr import Tf

    found: list[str] = []
    for name in names:
        plain = Tf.MakeValidIdentifier(name)
        taken = plain == "colliders" or plain in found
        found.append(f"{plain}_{len(found)}" if taken else plain)
    return found
