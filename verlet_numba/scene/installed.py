"""The scenes that come with the program."""

from pathlib import Path

SWEEPS = "sweeps"       # folder of sweep files, which are no scenes
PLACES = (Path(__file__).parents[1] / "scenes", Path(__file__).parents[2] / "scenes")    # installed; in a clone


def installed(folder: str = "") -> list[Path]:
    """Scene files, or those of one folder such as `paper`, in alphabetical order. Raises FileNotFoundError if there are none."""
    found = [scene for place in PLACES for scene in sorted((place / folder).rglob("*.yaml")) if scene.parent.name != SWEEPS]
    if not found:
        raise FileNotFoundError("the scenes of the program are not installed; name scenes")
    return found
