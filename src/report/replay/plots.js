// Plots of COM, DCM and ZMP over time between the limits of the support, one for each horizontal axis.

// Curves leave the picture where they are farther than this from the support (m).
const MOST_OUTSIDE = 0.12;
const PLOT_MARGIN = { left: 44, right: 10, top: 8, bottom: 20 };
const CURVES = [["zmpRef", "zmp_ref", 1.4], ["zmp", "zmp", 1.4], ["dcm", "dcm", 1.8], ["com", "com", 2.2]];

class Plot {
  constructor(canvas, film, axis, seek) {
    Object.assign(this, { canvas, film, axis });
    this.still = document.createElement("canvas");
    this.limits = Array.from({ length: film.count }, (_, i) => {
      const along = film.support(i).map((corner) => corner[axis]);
      return along.length ? [Math.min(...along), Math.max(...along)] : null;
    });
    this.range = this.findRange();
    const at = (event) => seek(this.timeAt(event.clientX - canvas.getBoundingClientRect().left));
    canvas.addEventListener("pointerdown", (event) => {
      // A vertical swipe scrolls the page (touch-action), and a horizontal one changes the time.
      canvas.setPointerCapture(event.pointerId);
      at(event);
    });
    canvas.addEventListener("pointermove", (event) => canvas.hasPointerCapture(event.pointerId) && at(event));
  }

  // The range of values: the support, and the curves near to it until a fall.
  findRange() {
    const { film, axis } = this;
    const fall = film.events.find((event) => event.kind === "fall"), until = fall ? film.index(fall.from_s)[0] : film.count - 1;
    const limits = this.limits.slice(0, until + 1).filter(Boolean).flat();
    const [least, most] = limits.length ? [Math.min(...limits), Math.max(...limits)] : [-0.1, 0.1];
    const values = [least, most];
    for (const [, name] of CURVES) {
      for (let i = 0; i <= until; i++) {
        const at = film[name](i, 0);
        if (at) values.push(clamp(at[axis], least - MOST_OUTSIDE, most + MOST_OUTSIDE));
      }
    }
    const low = values.reduce((a, b) => Math.min(a, b)), high = values.reduce((a, b) => Math.max(a, b));
    const room = 0.06 * (high - low);
    return [low - room, high + room];
  }

  timeAt(px) {
    const { left, right } = PLOT_MARGIN, { film } = this;
    const share = (px - left) / Math.max(1, this.canvas.clientWidth - left - right);
    return film.start + clamp(share, 0, 1) * (film.end - film.start);
  }

  // The pixel of a time, and below, of a value.
  x(time) {
    const { left, right } = PLOT_MARGIN, { film } = this;
    return left + ((time - film.start) / Math.max(film.end - film.start, 1e-9)) * (this.width - left - right);
  }

  y(value) {
    const { top, bottom } = PLOT_MARGIN, [low, high] = this.range;
    return this.height - bottom - ((value - low) / (high - low)) * (this.height - top - bottom);
  }

  // Draws everything but the present moment, which is only needed when size, colours or overlays change.
  render(theme, on) {
    const ratio = window.devicePixelRatio || 1, style = getComputedStyle(document.documentElement);
    const paint = (name) => style.getPropertyValue(name).trim();
    [this.width, this.height] = [this.canvas.clientWidth, this.canvas.clientHeight];
    for (const canvas of [this.canvas, this.still]) {
      [canvas.width, canvas.height] = [Math.round(this.width * ratio), Math.round(this.height * ratio)];
    }
    this.theme = theme;
    this.on = on;
    this.ink = paint("--ink");
    const pen = this.still.getContext("2d");
    pen.scale(ratio, ratio);
    pen.font = "11px system-ui, sans-serif";
    this.grid(pen, paint);
    pen.save();
    pen.beginPath();
    const { left, right, top, bottom } = PLOT_MARGIN;
    pen.rect(left, top, this.width - left - right, this.height - top - bottom);
    pen.clip();
    this.bands(pen);
    if (on.has("support")) this.support(pen);
    const { film } = this;
    for (const [id, name, width] of CURVES) if (on.has(id)) this.curve(pen, film, this.css(id), name, width);
    if (film.ghost && on.has(GHOST.id) && on.has("com")) {
      pen.setLineDash([4, 4]);
      this.curve(pen, film.ghost, this.css("com"), "com", 1.4);
    }
    pen.restore();
  }

  css(id, alpha = 1) {
    const [r, g, b] = colorOf(id, this.theme).map((x) => Math.round(255 * x));
    return `rgba(${r},${g},${b},${alpha})`;
  }

  grid(pen, paint) {
    // Distances between lines, in mm and in ms. Above a second they also suit minutes of 60 s.
    const steps = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10000, 20000, 60000, 120000, 300000, 600000];
    const nice = (span, most) => (steps.find((step) => span / (step / 1000) <= most) ?? 1000 * span) / 1000;
    const { film, range: [low, high], width, height } = this, { left, right, top, bottom } = PLOT_MARGIN;
    pen.strokeStyle = paint("--line");
    pen.fillStyle = paint("--soft");
    pen.lineWidth = 1;
    const rule = (x0, y0, x1, y1) => {
      pen.beginPath();
      pen.moveTo(x0, y0);
      pen.lineTo(x1, y1);
      pen.stroke();
    };
    const step = nice(high - low, Math.max(2, (height - top - bottom) / 20));
    pen.textAlign = "right";
    pen.textBaseline = "middle";
    for (let k = Math.ceil(low / step); k * step <= high; k++) {
      const y = Math.round(this.y(k * step)) + 0.5;
      rule(left, y, width - right, y);
      pen.fillText(String(Math.round(1000 * k * step)).replace("-", "\u2212"), left - 6, y);
    }
    const every = nice(film.end - film.start, Math.max(2, (width - left - right) / 46));
    const digits = every >= 1 ? 0 : every >= 0.1 ? 1 : every >= 0.01 ? 2 : 3;
    pen.textAlign = "center";
    pen.textBaseline = "top";
    for (let k = Math.ceil(film.start / every); k * every <= film.end + 1e-9; k++) {
      const x = Math.round(this.x(k * every)) + 0.5;
      rule(x, top, x, height - bottom);
      const text = (k * every).toFixed(digits), half = pen.measureText(text).width / 2;
      pen.fillText(text, Math.min(x, width - half), height - bottom + 5);
    }
  }

  // The times of pushes, footsteps, a meeting of the legs and a fall.
  bands(pen) {
    for (const { kind, from_s: from, to_s: to } of this.film.events) {
      if (!["push", "footstep", "legs", "fall", "parting"].includes(kind)) continue;
      const fills = { push: ["push", 0.25], footstep: ["footstep", 0.14], legs: ["push", 0.5], fall: ["push", 0.8], parting: ["ghost", 0.8] };
      pen.fillStyle = this.css(...fills[kind]);
      pen.fillRect(this.x(from), 0, Math.max(this.x(to) - this.x(from), 1.5), this.height);
    }
  }

  support(pen) {
    const { film, limits } = this;
    pen.fillStyle = this.css("support", 0.16);
    pen.strokeStyle = this.css("support", 0.85);
    pen.lineWidth = 1;
    for (let from = 0; from < film.count; from++) {
      if (!limits[from]) continue;
      let to = from;
      while (to + 1 < film.count && limits[to + 1]) to++;
      const point = (i, k) => [this.x(film.time(i)), this.y(limits[i][k])];
      const side = (k) => Array.from({ length: to - from + 1 }, (_, n) => point(from + n, k));
      const [low, high] = [side(0), side(1)];
      for (const [points, fills] of [[[...low, ...high.reverse()], true], [low, false], [high, false]]) {
        pen.beginPath();
        for (const [x, y] of points) pen.lineTo(x, y);
        if (fills) pen.fill();
        else pen.stroke();
      }
      from = to;
    }
  }

  curve(pen, film, color, name, width) {
    const { axis } = this;
    pen.strokeStyle = color;
    pen.lineWidth = width;
    pen.lineJoin = "round";
    pen.beginPath();
    let broken = true;
    for (let i = 0; i < film.count; i++) {
      const at = film[name](i, 0);
      if (at) pen[broken ? "moveTo" : "lineTo"](this.x(film.time(i)), this.y(at[axis]));
      broken = !at;
    }
    pen.stroke();
  }

  // Draws the present moment over the stored picture.
  draw(moment) {
    const ratio = window.devicePixelRatio || 1, pen = this.canvas.getContext("2d"), { top, bottom } = PLOT_MARGIN;
    pen.setTransform(1, 0, 0, 1, 0, 0);
    pen.clearRect(0, 0, this.canvas.width, this.canvas.height);
    pen.drawImage(this.still, 0, 0);
    pen.scale(ratio, ratio);
    const x = this.x(moment.time);
    pen.fillStyle = this.ink;
    pen.fillRect(x - 0.75, top, 1.5, this.height - top - bottom);
    for (const [id] of CURVES) {
      const at = moment[id];
      if (!this.on.has(id) || !at || at[this.axis] < this.range[0] || at[this.axis] > this.range[1]) continue;
      pen.beginPath();
      pen.arc(x, this.y(at[this.axis]), 3.4, 0, 2 * Math.PI);
      pen.fillStyle = this.css(id);
      pen.fill();
    }
  }
}
