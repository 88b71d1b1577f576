"""Checks between the parts of a scene: names, attachments, expectations, the step, the total of particles.

They look at the document as written, so that they tell what they can even where other parts of it are wrong.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from pydantic import ValidationError

from .messages import did_you_mean
from .problems import shown
from .schema import Scene, Solver, Time
from .schema_bodies import BODIES, BaseBody
from .schema_common import Finding, entry_name

MAX_TOTAL = 100_000_000        # particles of a scene
MIN_STEP = 1e-9                # s


def findings(data: Mapping[str, Any], scene: Scene | None) -> Iterator[Finding]:
    """What is wrong between parts of a scene that are each right; wrong parts are passed over.

    `scene` is what the document was validated to, None if it could not be.
    """
    bodies, colliders = _entries(data, "bodies"), _entries(data, "colliders")
    names = [entry_name(body, index) for index, body in enumerate(bodies)]
    valid = scene.bodies if scene else [_valid(body) for body in bodies]
    yield from _repeated("bodies", bodies, names)
    yield from _repeated("colliders", colliders, [entry_name(entry, index) for index, entry in enumerate(colliders)])
    yield from _attachments(_entries(data, "attachments"), dict(zip(names, valid, strict=True)))
    for row, expected in enumerate(_entries(data, "expect")):
        if isinstance(expected, Mapping) and isinstance(name := expected.get("body"), str) and name not in names:
            yield ("expect", row, "body"), _no_body(name, names)
    yield from _timing(data)
    total = sum(body.count * (body.particles or 0) for body in valid if body is not None)
    if total > MAX_TOTAL:
        yield ("bodies",), f"have {total:,} particles together; at most {MAX_TOTAL:,} are possible"


def _entries(data: Mapping[str, Any], key: str) -> Sequence[Any]:
    entries = data.get(key)
    return entries if isinstance(entries, list) else []


def _valid(body: Any) -> BaseBody | None:
    model = BODIES.get(str(body.get("kind"))) if isinstance(body, Mapping) else None
    if model is None:
        return None
    try:
        return model.model_validate({**body, "name": "body"})
    except ValidationError:
        return None


def _repeated(key: str, entries: Sequence[Any], names: Sequence[str | None]) -> Iterator[Finding]:
    first: dict[str, int] = {}
    for index, name in enumerate(names):
        if name is not None and first.setdefault(name, index) != index:
            path = (key, index, "name") if "name" in entries[index] else (key, index)
            yield path, f"the name {shown(name)} is that of {key}.{first[name]} already; give each its own"


def _attachments(rows: Sequence[Any], bodies: Mapping[str | None, BaseBody | None]) -> Iterator[Finding]:
    for row, entry in enumerate(rows):
        if not isinstance(entry, list) or len(entry) != 4:
            continue
        for end in (0, 2):
            name, number = entry[end], entry[end + 1]
            if not isinstance(name, str) or not isinstance(number, int | float):
                continue
            if name not in bodies:
                yield ("attachments", row, end), _no_body(name, bodies)
                continue
            body = bodies[name]
            if body is not None and body.particles is not None and number >= body.particles * body.count:
                count = body.particles * body.count
                yield (("attachments", row, end + 1),
                       f"there is no particle {number:g}: {shown(name)} has {count}, numbered from 0")
        if entry[:2] == entry[2:]:
            yield ("attachments", row), "attaches a particle to itself"


def _no_body(name: str, names: Any) -> str:
    known = [known for known in names if known is not None]
    return f"there is no body named {shown(name)}" + (
        did_you_mean(name, known) or f"; there are {', '.join(known[:10]) or 'no bodies'}")


def _timing(data: Mapping[str, Any]) -> Iterator[Finding]:
    try:
        time = Time.model_validate(data.get("time"))
        solver = Solver.model_validate(data.get("solver", {}))
    except ValidationError:
        return
    step = 1 / (time.frame_rate * solver.substeps)
    if step < MIN_STEP:
        path: tuple[str, ...] = ("solver", "substeps") if "solver" in data else ("time", "frame_rate")
        yield path, f"the step 1/(frame_rate * substeps) is {step:.3g} s; it must be at least {MIN_STEP:g} s"
    for row, expected in enumerate(_entries(data, "expect")):
        start = expected.get("from") if isinstance(expected, Mapping) else None
        if isinstance(start, int | float) and start > time.duration:
            yield ("expect", row, "from"), f"{start:g} s is after the end of the run, {time.duration:g} s"
