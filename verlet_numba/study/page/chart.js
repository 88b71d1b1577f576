// Energies above, constraint error below, over time; a line marks the present, and a press goes there.

const CURVES = { total_energy: ["total", "energy"], kinetic_energy: ["kinetic", "kinetic"], potential_energy: ["potential", "potential"],
  constraint_error_max: ["largest constraint error", "error"] };

class Chart {
  constructor(canvas, motion) {
    Object.assign(this, { canvas, motion });
    const listed = Object.keys(motion.header.measures);
    this.rows = [listed.filter((name) => name !== "constraint_error_max"), listed.filter((name) => name === "constraint_error_max")]
      .filter((names) => names.length);
  }

  // The time under a place across the picture, or the other way round, in CSS pixels.
  timeAt(x) {
    const { start, end } = this.motion;
    return start + (end - start) * Math.max(0, Math.min(1, x / this.canvas.clientWidth));
  }

  draw(time, colour) {
    const { canvas, motion } = this, pixels = devicePixelRatio || 1;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    canvas.width = width * pixels;
    canvas.height = height * pixels;
    const pen = canvas.getContext("2d");
    pen.scale(pixels, pixels);
    pen.font = "11px system-ui, sans-serif";
    const now = motion.nearest(time), tall = height / this.rows.length, span = motion.end - motion.start || 1;
    const across = (moment) => (moment - motion.start) / span * width;
    const told = [];
    this.rows.forEach((names, row) => {
      const top = row * tall + 18, bottom = (row + 1) * tall - 6;
      const values = names.map((name) => motion.arrays[name]);
      let low = Infinity, high = -Infinity;
      for (const list of values) for (const y of list) { if (y < low) low = y; if (y > high) high = y; }
      if (names[0] === "constraint_error_max") low = 0;
      if (!(high > low)) high = low + 1;
      const up = (y) => bottom - (y - low) / (high - low) * (bottom - top);
      let x = 0;
      names.forEach((name, k) => {
        const [label, variable] = CURVES[name], unit = motion.header.measures[name];
        const text = `${label} ${short(values[k][now])}${unit ? " " + unit : ""}`;
        told.push(text);
        pen.fillStyle = pen.strokeStyle = colour(variable);
        pen.fillText(text, x, row * tall + 11);
        x += pen.measureText(text).width + 8;
        pen.lineWidth = k ? 1 : 1.6;
        pen.beginPath();
        values[k].forEach((y, frame) => pen.lineTo(across(motion.time[frame]), up(y)));
        pen.stroke();
        pen.beginPath();
        pen.arc(across(motion.time[now]), up(values[k][now]), 2.6, 0, 7);
        pen.fill();
      });
      pen.strokeStyle = colour("edge");
      pen.lineWidth = 1;
      pen.strokeRect(0.5, top - 2, width - 1, bottom - top + 4);
    });
    pen.strokeStyle = colour("soft");
    pen.beginPath();
    pen.moveTo(across(time), 16);
    pen.lineTo(across(time), height);
    pen.stroke();
    canvas.setAttribute("aria-label", `Course of the measures, at present: ${told.join(", ")}`);
  }
}

function short(value) {
  if (!Number.isFinite(value)) return "none";
  const size = Math.abs(value);
  return size && (size < 1e-3 || size >= 1e6) ? value.toExponential(1) : String(Number(value.toPrecision(3)));
}
