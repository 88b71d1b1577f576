// The page: unpacks, keeps the clock, and joins the controls with what is drawn.

const SPEEDS = [0.05, 0.1, 0.25, 0.5, 1, 2, 4];
const LISTED = 12;              // bodies by name
const PLAY = "M6 4l14 8-14 8z", PAUSE = "M6 4h4v16H6zM14 4h4v16h-4z";
const element = (id) => document.getElementById(id);

class Player {
  constructor(motion, gl) {
    this.motion = motion;
    this.canvas = element("stage");
    this.orbit = new Orbit(motion.header.camera);
    this.stage = new Stage(gl, motion);
    this.chart = new Chart(element("chart").querySelector("canvas"), motion);
    Object.assign(this, { time: motion.start, playing: false, speed: 1, pending: false, before: null });
    this.tell();
    this.listen();
    if (!this.address() && !matchMedia("(prefers-reduced-motion: reduce)").matches) this.play(true);
    this.redraw();
  }

  // What stands in the address, such as #t=1.5&strain: a time to stop at, colours by strain. Whether there is a time.
  address() {
    const asked = new URLSearchParams(location.hash.slice(1));
    element("strain").checked = asked.has("strain") && this.motion.header.strain > 0;
    if (!asked.has("t")) return false;
    this.play(false);
    this.seek(Number(asked.get("t")) || 0);
    return true;
  }

  // What does not change.
  tell() {
    const { header } = this.motion;
    const names = new Map();
    for (const { name, colour } of header.bodies) {
      const kind = name.replace(/\.\d+$/, "");            // copies are NAME.0, NAME.1 ...
      names.set(kind, [...names.get(kind) ?? [], `rgb(${colour.map((part) => Math.round(255 * part))})`]);
    }
    for (const [name, colours] of [...names].slice(0, LISTED)) {
      const item = document.createElement("li");
      item.textContent = colours.length > 1 ? `${name} × ${colours.length}` : name;
      item.style.setProperty("--colour", `linear-gradient(90deg, ${[...new Set(colours)].map((each, k, all) =>
        `${each} ${100 * k / all.length}% ${100 * (k + 1) / all.length}%`)})`);
      element("bodies").append(item);
    }
    if (names.size > LISTED) element("bodies").append(`and ${names.size - LISTED} more`);
    for (const speed of SPEEDS) element("speed").append(new Option(`${speed} ×`, speed, speed === 1, speed === 1));
    element("strain-switch").hidden = element("strain").disabled = !header.strain;
    element("scale-low").textContent = `−${short(100 * header.strain)} %`;
    element("scale-high").textContent = `${short(100 * header.strain)} %`;
    element("chart").hidden = !this.chart.rows.length;
    const kept = header.every > 1 ? `every ${header.every}. of ${header.of} frames` : `${header.frames} frames`;
    element("about").textContent = `${header.file}: ${kept}, ${this.motion.particles} particles. Positions are kept in 16 bits: each `
      + `coordinate is within ${length(header.error)} of the trajectory's; strain may be off by ${short(100 * header.strain_error)} %. Between frames `
      + `positions are mixed. Grid: ${length(this.stage.cell)}${this.stage.planes[0].number === null ? ", drawn for orientation, no collider" : ""}.`;
    Object.assign(element("time"), { min: this.motion.start, max: this.motion.end, disabled: this.motion.frames < 2 });
  }

  listen() {
    this.orbit.follow(this.canvas, () => this.redraw());
    element("play").addEventListener("click", () => this.play(!this.playing));
    element("time").addEventListener("input", (event) => {
      this.play(false);
      this.seek(event.target.valueAsNumber);
    });
    element("speed").addEventListener("change", (event) => { this.speed = Number(event.target.value); });
    element("strain").addEventListener("change", () => this.redraw());
    element("home").addEventListener("click", () => this.home());
    document.querySelector("details").addEventListener("toggle", () => this.redraw());
    const chart = this.chart.canvas;
    const press = (event) => {
      if (event.type === "pointerdown") chart.setPointerCapture(event.pointerId);
      if (!chart.hasPointerCapture(event.pointerId)) return;
      this.play(false);
      this.seek(this.chart.timeAt(event.offsetX));
    };
    chart.addEventListener("pointerdown", press);
    chart.addEventListener("pointermove", press);
    addEventListener("keydown", (event) => this.key(event));
    addEventListener("resize", () => this.redraw());
    addEventListener("hashchange", () => {
      this.address();
      this.redraw();
    });
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.redraw());
    this.canvas.addEventListener("webglcontextlost", () => trouble("The graphics were taken away by the browser; reload the page."));
  }

  // A focused control keeps the keys that are its own.
  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const { motion } = this, name = event.target.tagName;
    const own = { SELECT: ["ArrowUp", "ArrowDown", "ArrowLeft", "ArrowRight", "Home", "End", " "], BUTTON: [" "], SUMMARY: [" "],
      INPUT: event.target.type === "checkbox" ? [" "] : [] }[name] ?? [];
    if (own.includes(event.key)) return;
    const step = (frames) => {
      this.play(false);
      this.seek(motion.time[Math.max(0, Math.min(motion.frames - 1, motion.nearest(this.time) + frames))]);
    };
    const faster = (places) => {
      const select = element("speed");
      select.selectedIndex = Math.max(0, Math.min(SPEEDS.length - 1, select.selectedIndex + places));
      this.speed = SPEEDS[select.selectedIndex];
    };
    const actions = {
      " ": () => this.play(!this.playing), ArrowLeft: () => step(-1), ArrowRight: () => step(1), Home: () => step(-Infinity),
      End: () => step(Infinity), ArrowUp: () => faster(1), ArrowDown: () => faster(-1), r: () => this.home(),
      s: () => element("strain").click(), "+": () => this.zoom(1 / 1.15), "=": () => this.zoom(1 / 1.15), "-": () => this.zoom(1.15) };
    const action = actions[event.key] ?? actions[event.key.toLowerCase()];
    if (!action) return;
    event.preventDefault();
    action();
  }

  zoom(factor) {
    this.orbit.zoom(factor);
    this.redraw();
  }

  home() {
    this.orbit.home();
    this.redraw();
  }

  play(on) {
    this.playing = on && this.motion.frames > 1;
    if (this.playing && this.time >= this.motion.end) this.time = this.motion.start;
    this.before = null;
    element("play").setAttribute("aria-label", this.playing ? "Pause" : "Play");
    this.redraw();
  }

  seek(time) {
    this.time = Math.max(this.motion.start, Math.min(this.motion.end, time));
    this.redraw();
  }

  // Once before the browser shows its next picture, however often it is asked for; nothing runs while nothing changes.
  redraw() {
    if (this.pending) return;
    this.pending = true;
    requestAnimationFrame((now) => {
      this.pending = false;
      if (this.playing) this.tick(now);
      this.draw();
      if (this.playing) this.redraw();
    });
  }

  tick(now) {
    const { start, end } = this.motion;
    if (this.before !== null) this.time += this.speed * Math.min(0.25, (now - this.before) / 1000);
    this.before = now;
    if (this.time > end) this.time = start + (this.time - end) % (end - start);
  }

  // How much of the picture's bottom lies under controls, CSS pixels.
  covered() {
    const all = this.canvas.clientHeight, tops = [document.querySelector("footer"), element("chart")]
      .map((each) => each.getBoundingClientRect().top).filter((top) => top > 0.5 * all);
    return all - Math.min(all, ...tops);
  }

  draw() {
    const { canvas, motion, time } = this, pixels = Math.min(2, devicePixelRatio || 1);
    const [width, height] = [Math.round(canvas.clientWidth * pixels), Math.round(canvas.clientHeight * pixels)];
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    const style = getComputedStyle(document.documentElement);
    const colour = (name) => style.getPropertyValue(`--${name}`).trim();
    const parts = (name) => [1, 3, 5].map((k) => parseInt(colour(name).slice(k, k + 2), 16) / 255);
    motion.seek(time, element("strain").checked);
    this.stage.draw(time, this.orbit.view(width, height, this.covered() * pixels), { paper: parts("paper"), ground: parts("ground"), line: parts("line") }, width, height);
    if (this.chart.rows.length) this.chart.draw(time, colour);
    const frame = motion.nearest(time), clock = `${time.toFixed(2)} s`;
    element("scale").hidden = !element("strain").checked;
    element("play").querySelector("path").setAttribute("d", this.playing ? PAUSE : PLAY);
    element("time").value = time;
    element("time").setAttribute("aria-valuetext", `${clock} of ${motion.end.toFixed(2)} s`);
    element("clock").textContent = innerWidth > 600 ? `${clock} · frame ${frame + 1} / ${motion.frames}` : clock;
    Object.assign(document.body.dataset, { time: time.toFixed(6), frame, playing: this.playing });
  }
}

// m in the unit that suits.
function length(metres) {
  const [unit, size] = [["km", 1e3], ["m", 1], ["cm", 1e-2], ["mm", 1e-3], ["µm", 1e-6]].find(([, size]) => metres >= size) ?? ["nm", 1e-9];
  return `${short(metres / size)} ${unit}`;
}

function trouble(text) {
  element("trouble").textContent = text;
  element("trouble").hidden = false;
}

async function start() {
  const gl = element("stage").getContext("webgl2", { alpha: false, antialias: true });
  if (!gl) return trouble("This page needs WebGL2, which this browser does not offer.");
  if (!("DecompressionStream" in window)) return trouble("This page needs a browser of 2023 or later (DecompressionStream).");
  try {
    const header = JSON.parse(element("header").textContent);
    new Player(new Motion(header, await unpack(element("data").textContent, header.arrays)), gl);
  } catch (error) {
    trouble(`This page cannot be shown: ${error.message}`);
    throw error;
  }
}

start();
