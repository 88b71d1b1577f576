"""Make a training set for a network that learns how meshes move: python docs/training_set.py OUT_FOLDER RUN.vtkhdf...

Each cloth of each run becomes OUT_FOLDER/RUN_BODY.npz: a graph whose nodes move.

    position    (T, n, 3) float32, m        velocity    (T, n, 3) float32, m/s
    triangles   (F, 3)                      edges       (E, 2), each once, i < j
    rest        (E,) m, lengths at rest     pinned      (n,) whether a particle never moves
    interval    s between frames            wind        (3,) m/s, what drives it

and OUT_FOLDER/set.json tells how many samples there are, and the mean and spread of velocity and acceleration to normalise by.
"""

import json
import sys
from pathlib import Path

import numpy as np

import verlet_numba


def graph(run, body):
    """One cloth as arrays. Velocities are the run's own where it has them, differences of frames where not."""
    position = body.positions()
    velocity = body.velocities()
    if velocity is None:
        velocity = np.gradient(position.astype(float), run.time, axis=0)
    edges, first = np.unique(np.sort(body.pairs, axis=1), axis=0, return_index=True)
    wind = run.scene["effects"].get("wind") or {"velocity": [0, 0, 0]}
    return {"position": position, "velocity": velocity.astype(np.float32), "triangles": body.triangles, "edges": edges,
            "rest": body.lengths[first], "pinned": np.ptp(position, axis=0).max(axis=1) == 0, "interval": run.time[1] - run.time[0],
            "wind": np.array(wind["velocity"], float)}


def moments(samples):
    """Mean and standard deviation of what is learnt: velocities, and how they change from frame to frame."""
    told = {}
    for name, rows in samples.items():
        rows = np.concatenate(rows)
        told[name] = {"mean": rows.mean(axis=0).tolist(), "spread": rows.std(axis=0).tolist()}
    return told


def main(folder, files):
    folder.mkdir(parents=True, exist_ok=True)
    graphs, frames, samples = 0, 0, {"velocity": [], "acceleration": []}
    for file in files:
        with verlet_numba.open(file) as run:
            for name in [body.name for body in run.bodies if body.kind == "cloth"]:
                made = graph(run, run.body(name))
                np.savez_compressed(folder / f"{file.stem}_{name}.npz", **made)
                free = ~made["pinned"]
                samples["velocity"].append(made["velocity"][:, free].reshape(-1, 3))
                samples["acceleration"].append((np.diff(made["velocity"][:, free], axis=0) / made["interval"]).reshape(-1, 3))
                graphs, frames = graphs + 1, frames + len(made["position"])
    if not graphs:
        sys.exit("there is no cloth in these runs")
    told = {"graphs": graphs, "samples": frames - graphs, **moments(samples)}      # a sample: a frame and the next
    (folder / "set.json").write_text(json.dumps(told, indent=2), encoding="utf-8")
    print(f"{folder}: {graphs} graphs, {told['samples']} samples")


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    main(Path(sys.argv[1]), [Path(word) for word in sys.argv[2:]])
