// Everything that is drawn: bodies as surfaces, tubes and balls, colliders, the ground, and their shadows.

const SUN = unit([-0.35, -0.50, 0.79]);
const SHADOWS = 2048;           // pixels a side of the shadow map
const FLOATS = 4;               // bytes

class Stage {
  constructor(gl, motion) {
    Object.assign(this, { gl, motion, scale: motion.header.camera.scale, centre: motion.header.camera.centre });
    this.programs = Object.fromEntries(["mesh", "tube", "ball", "plane"].map((name) => [name, new Program(gl, name)]));
    this.depths = Object.fromEntries(["mesh", "tube", "ball"].map((name) => [name, new Program(gl, name, true)]));
    this.shadow = depthMap(gl, SHADOWS);
    this.sun = this.sunView();
    this.bodies();
    this.lines();
    this.colliders();
    gl.enable(gl.DEPTH_TEST);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
  }

  bodies() {
    const { gl, motion } = this;
    const buffers = { position: filled(gl, motion.positions, gl.DYNAMIC_DRAW), normal: filled(gl, motion.normals, gl.DYNAMIC_DRAW),
      colour: filled(gl, motion.colours, gl.DYNAMIC_DRAW) };
    const attributes = { position: { buffer: buffers.position }, normal: { buffer: buffers.normal },
      colour: { buffer: buffers.colour, type: gl.UNSIGNED_BYTE } };
    this.surfaces = [[motion.sheets, false], [motion.solids, true]].filter(([corners]) => corners.length)
      .map(([corners, faceted]) => ({ array: vertexArray(gl, attributes, corners), count: corners.length, faceted }));
    this.buffers = buffers;
  }

  // Tubes and balls: one row of numbers each, which `update` fills: start, end, two colours, radius; position, colour, radius.
  lines() {
    const { gl, motion } = this, { segments, dots } = motion.arrays;
    this.tubes = new Float32Array(13 * segments.length / 2);
    this.balls = new Float32Array(7 * dots.length);
    this.buffers.tubes = filled(gl, this.tubes, gl.DYNAMIC_DRAW);
    this.buffers.balls = filled(gl, this.balls, gl.DYNAMIC_DRAW);
    const rows = (buffer, width, parts) => vertexArray(gl, Object.fromEntries(Object.entries(parts).map(([name, [offset, size]]) =>
      [name, { buffer, size, offset: FLOATS * offset, stride: FLOATS * width, each: true }])));
    this.tubeArray = rows(this.buffers.tubes, 13, { start: [0, 3], end: [3, 3], start_colour: [6, 3], end_colour: [9, 3], radius: [12, 1] });
    this.ballArray = rows(this.buffers.balls, 7, { position: [0, 3], colour: [3, 3], radius: [6, 1] });
  }

  colliders() {
    const { gl, motion } = this, { header, arrays } = motion;
    this.solids = [];
    this.planes = [];
    header.colliders.forEach((collider, number) => {
      const corners = arrays[`corners ${number}`];
      if (corners.length) {
        const { positions, normals } = creased(arrays[`points ${number}`], corners);
        const array = vertexArray(gl, { position: { buffer: filled(gl, positions) }, normal: { buffer: filled(gl, normals) } });
        this.solids.push({ number, array, count: corners.length, colour: collider.colour });
      }
      for (const side of collider.sides) this.planes.push({ number, ...side });
    });
    if (!this.planes.length) {          // no ground in the scene: a grid alone, at the lowest place
      this.planes.push({ number: null, origin: [0, 0, header.low[2]], u: [1, 0, 0], v: [0, 1, 0], half: null });
    }
    this.cell = roundNumber(0.06 * this.scale);
  }

  // From far away along the sun's rays, wide enough for all that moves.
  sunView() {
    const right = unit(cross([0, 0, 1], SUN)), up = cross(SUN, right), half = 0.75 * this.scale;
    const matrix = product(parallel(half), lookFrom(this.centre, right, up, SUN));
    return { matrix, eye: [...SUN, 0], pixel: 0, texel: 2 * half / SHADOWS };
  }

  update() {
    const { gl, motion, buffers } = this, { positions, colours, owner, arrays } = motion;
    const particle = (target, place, from, i, factor) => {
      for (let k = 0; k < 3; k++) target[place + k] = from[3 * i + k] * factor;
    };
    for (let s = 0; s < arrays.segments.length / 2; s++) {
      const [i, j] = [arrays.segments[2 * s], arrays.segments[2 * s + 1]];
      particle(this.tubes, 13 * s, positions, i, 1);
      particle(this.tubes, 13 * s + 3, positions, j, 1);
      particle(this.tubes, 13 * s + 6, colours, i, 1 / 255);
      particle(this.tubes, 13 * s + 9, colours, j, 1 / 255);
      this.tubes[13 * s + 12] = motion.header.bodies[owner[i]].line;
    }
    arrays.dots.forEach((i, d) => {
      particle(this.balls, 7 * d, positions, i, 1);
      particle(this.balls, 7 * d + 3, colours, i, 1 / 255);
      this.balls[7 * d + 6] = motion.header.bodies[owner[i]].dot;
    });
    refill(gl, buffers.position, positions);
    refill(gl, buffers.normal, motion.normals);
    refill(gl, buffers.colour, colours);
    refill(gl, buffers.tubes, this.tubes);
    refill(gl, buffers.balls, this.balls);
  }

  // `look`: colours of the background, the ground and its lines.
  draw(time, view, look, width, height) {
    const { gl } = this;
    this.update();
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.shadow.frame);
    gl.viewport(0, 0, SHADOWS, SHADOWS);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    this.things(this.depths, this.sun, time);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, width, height);
    gl.clearColor(...look.paper, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.bindTexture(gl.TEXTURE_2D, this.shadow.texture);
    this.things(this.programs, view, time);
    this.ground(view, look, time);
    gl.bindTexture(gl.TEXTURE_2D, null);
  }

  uniforms(view) {
    return { matrix: view.matrix, eye: view.eye, pixel_size: view.pixel, light: SUN, light_matrix: this.sun.matrix, texel: this.sun.texel, shadow: 0 };
  }

  // All that casts shadows, as seen by the eye or by the sun.
  things(programs, view, time) {
    const { gl, motion } = this, common = this.uniforms(view);
    for (const { array, count, faceted } of this.surfaces) {
      programs.mesh.use({ ...common, model: IDENTITY, faceted, sheet: !faceted });
      gl.bindVertexArray(array);
      gl.drawElements(gl.TRIANGLES, count, gl.UNSIGNED_INT, 0);
    }
    for (const { number, array, count, colour } of this.solids) {
      programs.mesh.use({ ...common, model: motion.pose(number, time), faceted: false, sheet: false });
      gl.bindVertexArray(array);
      gl.vertexAttrib3fv(PLACES.colour, colour);
      gl.drawArrays(gl.TRIANGLES, 0, count);
    }
    for (const [program, array, rows] of [[programs.tube, this.tubeArray, this.tubes.length / 13], [programs.ball, this.ballArray, this.balls.length / 7]]) {
      if (!rows) continue;
      program.use(common);
      gl.bindVertexArray(array);
      gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, rows);
    }
    gl.bindVertexArray(null);
  }

  // Planes and walls, from their front alone; planes without end fade into the background.
  ground(view, look, time) {
    const { gl, motion } = this, reach = 6 * this.scale;
    for (const { number, origin, u, v, half } of this.planes) {
      const pose = number === null ? IDENTITY : motion.pose(number, time), ghost = number === null;
      const side = { origin: moved(pose, origin), u: turned(pose, u), v: turned(pose, v) };
      const normal = cross(side.u, side.v), away = minus(this.centre, side.origin);
      if (dot(minus(view.eye.slice(0, 3), side.origin), normal) <= 0 && !ghost) continue;
      const middle = half ? [0, 0] : [dot(away, side.u), dot(away, side.v)];
      this.programs.plane.use({ ...this.uniforms(view), ...side, ...look, middle, half_size: half ?? [reach, reach], cell: this.cell,
        reach: half ? 0 : reach, ghost });
      if (ghost) gl.enable(gl.BLEND);
      gl.depthMask(!ghost);
      gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
      gl.depthMask(true);
      gl.disable(gl.BLEND);
    }
  }
}

// The largest of 1, 2, 5 times a power of ten that is at most `size`.
function roundNumber(size) {
  const power = 10 ** Math.floor(Math.log10(size));
  return power * [5, 2, 1].find((step) => step * power <= size * (1 + 1e-9));
}
