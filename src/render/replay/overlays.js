// What is drawn over the robot: where its COM, ZMP and DCM are, what holds it, and what pushes it.

const OVERLAYS = [
  ...Object.values(PALETTE.overlays),
  { id: "trail", key: "t", name: "trails", color: "#7f8894", hint: "COM and DCM over the ground until now" },
];
// The robot itself: without it, a ghost that hides nothing.
const BODY = { id: "body", key: "b", name: "body", color: "#593399", hint: "the robot; else a ghost that hides nothing" };
// A push is short: its arrow stays for a while, faint (s).
const AFTERGLOW = 0.3;
// Above the floor, so that marks do not flicker, and the foot of the COM's plumb line (m); these and other lengths are for a
// robot of the size of UT-mu2.
const ABOVE = 0.0018, FOOT = 0.0075;

// As parts of 1; on a dark ground, brighter.
function colorOf(id, theme) {
  const hex = OVERLAYS.find((overlay) => overlay.id === id).color;
  const parts = [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16) / 255);
  return theme === "dark" ? parts.map((x) => x + 0.32 * (1 - x)) : parts;
}

// Lines, filled polygons and solid shapes of a moment: each overlay as its style says. A solid says how much of it shows
// through what is before it.
class Overlays {
  constructor(film, moment, theme, on) {
    Object.assign(this, { film, moment, large: film.robot.length, lines: [], fills: [], solids: [] });
    for (const { id, style } of Object.values(PALETTE.overlays)) {
      if (!on.has(id)) continue;
      const [shown, alpha] = id === "push" ? this.push() : [moment[id], 1];
      if (shown) this[style.shape](shown, colorOf(id, theme), style, alpha);
    }
    if (on.has("trail")) for (const id of ["com", "dcm"]) this.trail(colorOf(id, theme), film[id]);
  }

  // A place on the floor.
  on([x, y]) {
    return [x, y, this.film.height(this.moment.slope, x, y) + ABOVE * this.large];
  }

  polygon(corners, color, { sheet: { fill, edge, width } }) {
    const points = corners.map((corner) => this.on(corner));
    points.forEach((point, i) => {
      this.lines.push([point, points[(i + 1) % points.length], [...color, edge], width]);
      if (i > 1) this.fills.push([points[0], points[i - 1], point, [...color, fill]]);
    });
  }

  // Nested, the fastest innermost; the active one over the others.
  sets(slices, color, { resting, acting }) {
    const { gain } = this.moment;
    slices.forEach((slice, i) => i !== gain && this.polygon(slice, color, { sheet: resting }));
    if (gain !== null && slices[gain]) this.polygon(slices[gain], color, { sheet: acting });
  }

  spot(at, color, { radius_m: radius }) {
    const size = radius * this.large;
    const disc = (size) => Array.from({ length: 28 }, (_, k) => {
      const angle = (2 * Math.PI * k) / 28;
      return [at[0] + size * Math.cos(angle), at[1] + size * Math.sin(angle)];
    });
    this.polygon(disc(1.22 * size), [1, 1, 1], { sheet: { fill: 0.9, edge: 0.9, width: 0 } });
    this.polygon(disc(size), color, { sheet: { fill: 1, edge: 1, width: 0 } });
  }

  ball(center, color, { radius_m: radius, through }) {
    this.spot(center, color, { radius_m: FOOT });
    this.lines.push([this.on(center), center, [...color, 0.9], 2]);
    // In white, so that it shows in a robot of any colour.
    for (const [part, rgb] of [[1, [1, 1, 1]], [0.82, color]]) {
      const size = part * radius * this.large;
      this.solids.push(["sphere", { p: center, q: [0, 0, 0, 1] }, [size, size, size], [...rgb, 1], through]);
    }
  }

  // One force or several.
  arrow(forces, color, { m_per_n: long, ends, radius_m: radius, through }, alpha) {
    for (const { point, force } of [forces].flat().filter(Boolean)) {
      const along = scaled(force, long / this.film.robot.stiffness), size = length(along);
      if (size < 1e-4) continue;
      const from = ends ? sub(point, along) : point, q = fromZ(along);
      const head = Math.min(6 * radius * this.large, 0.6 * size), thick = Math.min(radius * this.large, 0.3 * head);
      const at = (share) => add(from, scaled(along, share / size)), shaft = (size - head) / 2, tint = [...color, alpha];
      this.solids.push(["cylinder", { p: at(shaft), q }, [thick, thick, shaft], tint, through]);
      this.solids.push(["cone", { p: at(size - head / 2), q }, [2.4 * thick, 2.4 * thick, head / 2], tint, through]);
    }
  }

  // The push that acts, or acted a moment ago, and how strong it shows.
  push() {
    const { film, moment } = this;
    if (moment.push) return [moment.push, 1];
    for (let i = moment.i; i >= 0 && moment.time - film.time(i) < AFTERGLOW; i--) {
      const push = arrow(film.push(i, 0));
      if (push) return [push, 0.45 * (1 - (moment.time - film.time(i)) / AFTERGLOW)];
    }
    return [null, 0];
  }

  trail(color, path) {
    const every = Math.max(1, Math.round(0.006 / this.film.period));
    let last = null;
    for (let i = 0; i <= this.moment.i; i += every) {
      const at = path(i, 0), point = at && this.on(at);
      if (point && last) this.lines.push([last, point, [...color, 0.75], 1.8]);
      last = point;
    }
  }
}

// Draws fills, and over them lines of some pixels' width: WebGL's own have one. A line is a rectangle between its ends, turned
// to the screen; a corner of a fill is the end of a line without width.
class OverlayLayer {
  constructor(gl) {
    this.gl = gl;
    this.program = program(gl, `
layout(location = 0) in vec3 here;
layout(location = 1) in vec3 other;
layout(location = 2) in vec4 tint;
layout(location = 3) in float wide;
uniform mat4 view;
uniform vec2 screen;
out vec4 color;
void main() {
  vec4 a = view * vec4(here, 1.0), b = view * vec4(other, 1.0);
  vec2 along = (b.xy / b.w - a.xy / a.w) * screen;
  vec2 across = normalize(vec2(-along.y, along.x) + vec2(1e-6, 0.0));
  a.xy += across * wide / screen * a.w;
  color = tint;
  gl_Position = a;
}`, "in vec4 color; uniform float alpha; out vec4 shown; void main() { shown = vec4(color.rgb, color.a * alpha); }");
    this.buffer = vertices(gl, [3, 3, 4, 1]);
  }

  draw({ lines, fills }, view, screen, alpha) {
    const { gl, program: { made, uniforms } } = this, ratio = window.devicePixelRatio || 1, data = [];
    for (const [a, b, c, color] of fills) for (const at of [a, b, c]) data.push(...at, ...at, ...color, 0);
    for (const [a, b, color, width] of lines) {
      const w = width * ratio;
      // Seen from the other end, left is right.
      const from = (side) => [...a, ...b, ...color, side], to = (side) => [...b, ...a, ...color, -side];
      data.push(...from(w), ...from(-w), ...to(w), ...to(w), ...from(-w), ...to(-w));
    }
    gl.useProgram(made);
    gl.uniformMatrix4fv(uniforms.view, false, view);
    gl.uniform1f(uniforms.alpha, alpha);
    gl.uniform2fv(uniforms.screen, screen);
    gl.bindVertexArray(this.buffer.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(data), gl.DYNAMIC_DRAW);
    gl.drawArrays(gl.TRIANGLES, 0, data.length / 11);
  }
}
