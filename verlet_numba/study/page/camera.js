// An eye that turns about a point, z up; fingers, mouse and wheel move it.

const OPENING = Math.tan(14 * Math.PI / 180);      // of half the angle of view, along the shorter side of the picture
const STEEPEST = 89 * Math.PI / 180;

class Orbit {
  constructor({ eye, centre, scale }) {
    const from = minus(eye, centre);
    this.scale = scale;
    this.start = { centre, distance: Math.hypot(...from), azimuth: Math.atan2(from[1], from[0]),
      elevation: Math.asin(from[2] / Math.hypot(...from)) };
    this.home();
  }

  home() {
    Object.assign(this, this.start);
  }

  turn(right, up) {
    this.azimuth -= right;
    this.elevation = Math.max(-STEEPEST, Math.min(STEEPEST, this.elevation + up));
  }

  zoom(factor) {
    this.distance = Math.max(0.01 * this.scale, Math.min(100 * this.scale, this.distance * factor));
  }

  axes() {
    const [a, e] = [this.azimuth, this.elevation];
    const back = [Math.cos(a) * Math.cos(e), Math.sin(a) * Math.cos(e), Math.sin(e)];
    const right = [-Math.sin(a), Math.cos(a), 0];
    return { right, up: cross(back, right), back };
  }

  // By parts of the picture's shorter side.
  pan(right, up) {
    const axes = this.axes(), span = 2 * OPENING * this.distance;
    this.centre = minus(this.centre, add(times(right * span, axes.right), times(up * span, axes.up)));
  }

  // What drawing needs: matrix, eye (w = 1: a point), and the width of a pixel at distance 1. `covered`: pixels at the bottom that
  // controls hide; the centre stands in the middle of the rest, seen from further away where that is smaller or narrower than 4:3.
  view(width, height, covered) {
    const { right, up, back } = this.axes(), free = height - covered;
    const distance = this.distance * Math.max(1, 4 / 3 * free / width) * height / free;
    const eye = add(this.centre, times(distance, back));
    const lens = perspective([OPENING * width / height, OPENING], 0.02 * distance, 40 * this.scale + 2 * distance);
    lens[9] = -covered / height;
    return { matrix: product(lens, lookFrom(eye, right, up, back)), eye: [...eye, 1], pixel: 2 * OPENING / height };
  }

  // Pointers on an element: one turns, two (or one with the right button or shift) move, two also zoom. `changed` is told.
  follow(element, changed) {
    const held = new Map();
    const middle = () => [...held.values()].reduce((sum, at) => [sum[0] + at[0] / held.size, sum[1] + at[1] / held.size], [0, 0]);
    const spread = () => {
      const [a, b] = [...held.values()];
      return Math.hypot(a[0] - b[0], a[1] - b[1]) || 1;
    };
    element.addEventListener("pointerdown", (event) => {
      held.set(event.pointerId, [event.clientX, event.clientY]);
      element.setPointerCapture(event.pointerId);
    });
    element.addEventListener("pointermove", (event) => {
      if (!held.has(event.pointerId)) return;
      const [before, apart] = [middle(), held.size === 2 ? spread() : 1];
      held.set(event.pointerId, [event.clientX, event.clientY]);
      const after = middle(), size = Math.min(element.clientWidth, element.clientHeight);
      const [dx, dy] = [(after[0] - before[0]) / size, (after[1] - before[1]) / size];
      if (held.size > 1 || event.shiftKey || event.buttons & 6) this.pan(dx, -dy);
      else this.turn(4 * dx, 3 * dy);
      if (held.size === 2) this.zoom(apart / spread());
      changed();
    });
    for (const end of ["pointerup", "pointercancel"]) element.addEventListener(end, (event) => held.delete(event.pointerId));
    element.addEventListener("contextmenu", (event) => event.preventDefault());
    element.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoom(Math.exp(0.0012 * event.deltaY * (event.deltaMode === 1 ? 30 : 1)));
      changed();
    }, { passive: false });
  }
}
