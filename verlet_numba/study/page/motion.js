// The state at any time: positions between two frames, normals of sheets, strain, colours, poses of colliders.

const COLD = [33, 102, 172], MIDDLE = [217, 217, 217], HOT = [178, 24, 43];       // pressed, at rest, stretched

class Motion {
  constructor(header, arrays) {
    Object.assign(this, { header, arrays, time: arrays.time, frames: header.frames });
    this.particles = header.bodies.reduce((sum, body) => sum + body.particles, 0);
    this.words = wholeSteps(arrays.position, this.frames, this.particles);
    this.positions = new Float32Array(3 * this.particles);
    this.normals = new Float32Array(3 * this.particles);
    this.strains = new Float32Array(this.particles);
    this.colours = new Uint8Array(3 * this.particles);
    this.owner = new Uint32Array(this.particles);
    let first = 0;
    header.bodies.forEach((body, number) => {
      this.owner.fill(number, first, first + body.particles);
      first += body.particles;
    });
    const faceted = (corner) => header.bodies[this.owner[corner]].faceted;
    const corners = [...Array(arrays.triangles.length / 3).keys()];
    const chosen = (wanted) => Uint32Array.from(corners.filter((k) => faceted(arrays.triangles[3 * k]) === wanted)
      .flatMap((k) => [...arrays.triangles.subarray(3 * k, 3 * k + 3)]));
    this.sheets = chosen(false);
    this.solids = chosen(true);
  }

  get start() { return this.time[0]; }
  get end() { return this.time[this.frames - 1]; }

  // The frame before a time, and how far the time is towards the next.
  place(time) {
    let low = 0, high = this.frames - 1;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (this.time[middle] <= time) low = middle; else high = middle;
    }
    const span = this.time[high] - this.time[low];
    return [low, high, span > 0 ? Math.max(0, Math.min(1, (time - this.time[low]) / span)) : 0];
  }

  nearest(time) {
    const [low, high, part] = this.place(time);
    return part < 0.5 ? low : high;
  }

  seek(time, byStrain) {
    const { low, step } = this.header, n = this.particles, [a, b, part] = this.place(time);
    for (let axis = 0; axis < 3; axis++) {
      const first = (3 * a + axis) * n, second = (3 * b + axis) * n;
      for (let i = 0; i < n; i++) {
        const x = this.words[first + i];
        this.positions[3 * i + axis] = low[axis] + step[axis] * (x + part * (this.words[second + i] - x));
      }
    }
    this.turnNormals();
    if (byStrain) this.colourByStrain(); else this.colourByBody();
  }

  // Of every corner of a sheet: the sum over its triangles, each as long as twice its area.
  turnNormals() {
    const { positions: p, normals, sheets } = this;
    normals.fill(0);
    for (let k = 0; k < sheets.length; k += 3) {
      const a = 3 * sheets[k], b = 3 * sheets[k + 1], c = 3 * sheets[k + 2];
      const ux = p[b] - p[a], uy = p[b + 1] - p[a + 1], uz = p[b + 2] - p[a + 2];
      const vx = p[c] - p[a], vy = p[c + 1] - p[a + 1], vz = p[c + 2] - p[a + 2];
      const x = uy * vz - uz * vy, y = uz * vx - ux * vz, z = ux * vy - uy * vx;
      for (const corner of [a, b, c]) {
        normals[corner] += x;
        normals[corner + 1] += y;
        normals[corner + 2] += z;
      }
    }
  }

  // d / rest - 1 of the stick at each particle that is furthest off its length.
  colourByStrain() {
    const { positions: p, strains, colours } = this, { pairs, lengths } = this.arrays;
    strains.fill(0);
    for (let k = 0; k < lengths.length; k++) {
      if (!(lengths[k] > 0)) continue;
      const i = pairs[2 * k], j = pairs[2 * k + 1];
      const long = Math.hypot(p[3 * i] - p[3 * j], p[3 * i + 1] - p[3 * j + 1], p[3 * i + 2] - p[3 * j + 2]);
      const strain = long / lengths[k] - 1;
      if (Math.abs(strain) > Math.abs(strains[i])) strains[i] = strain;
      if (Math.abs(strain) > Math.abs(strains[j])) strains[j] = strain;
    }
    for (let i = 0; i < this.particles; i++) {
      const part = Math.max(-1, Math.min(1, strains[i] / this.header.strain));
      const end = part < 0 ? COLD : HOT;
      for (let k = 0; k < 3; k++) colours[3 * i + k] = MIDDLE[k] + Math.abs(part) * (end[k] - MIDDLE[k]);
    }
  }

  colourByBody() {
    const palette = this.header.bodies.map((body) => body.colour);
    for (let i = 0; i < this.particles; i++) {
      for (let k = 0; k < 3; k++) this.colours[3 * i + k] = 255 * palette[this.owner[i]][k];
    }
  }

  // Where a collider is: between two frames its axes are mixed and made unit vectors again.
  pose(collider, time) {
    const poses = this.arrays[`poses ${collider}`];
    const [a, b, part] = poses.length > 12 ? this.place(time) : [0, 0, 0];
    const mixed = Array.from(poses.subarray(12 * a, 12 * a + 12), (x, k) => x + part * (poses[12 * b + k] - x));
    const matrix = poseMatrix(mixed);
    for (const first of [0, 4, 8]) matrix.splice(first, 3, ...unit(matrix.slice(first, first + 3)));
    return matrix;
  }
}

// A mesh that stands still as triangles with normals: faces within 35 degrees of each other are one smooth surface.
function creased(points, corners) {
  const at = (i) => [...points.subarray(3 * i, 3 * i + 3)];
  const faces = corners.length / 3, areas = [], around = new Map();
  for (let face = 0; face < faces; face++) {
    const [a, b, c] = [0, 1, 2].map((k) => at(corners[3 * face + k]));
    areas.push(cross(minus(b, a), minus(c, a)));
    for (let k = 0; k < 3; k++) {
      const corner = corners[3 * face + k];
      if (!around.has(corner)) around.set(corner, []);
      around.get(corner).push(face);
    }
  }
  const positions = new Float32Array(9 * faces), normals = new Float32Array(9 * faces);
  const units = areas.map(unit);
  for (let face = 0; face < faces; face++) {
    for (let k = 0; k < 3; k++) {
      const corner = corners[3 * face + k];
      const alike = around.get(corner).filter((other) => dot(units[face], units[other]) > 0.82);
      positions.set(at(corner), 9 * face + 3 * k);
      normals.set(unit(alike.reduce((sum, other) => add(sum, areas[other]), [0, 0, 0])), 9 * face + 3 * k);
    }
  }
  return { positions, normals };
}
