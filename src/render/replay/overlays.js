// What is drawn over the robot: where its COM, ZMP and DCM are, what holds it, and what pushes it.

const OVERLAYS = [
  { ...PALETTE.overlays.com, hint: "centre of mass, and its projection on the ground" },
  { ...PALETTE.overlays.dcm, hint: "divergent component of motion (capture point)" },
  { ...PALETTE.overlays.zmp, hint: "measured: from the forces under the soles" },
  { ...PALETTE.overlays.zmpRef, hint: "the one that the controller asks for" },
  { ...PALETTE.overlays.support, hint: "hull of the soles on the ground" },
  { ...PALETTE.overlays.sets, hint: "where the COM may be, by gain; the active one is filled" },
  { ...PALETTE.overlays.footstep, hint: "where the foot in the air is to land" },
  { ...PALETTE.overlays.contacts, hint: "on each sole" },
  { ...PALETTE.overlays.push, hint: "it fades after it ends" },
  { id: "trail", key: "t", name: "trails", color: "#7f8894", hint: "COM and DCM over the ground until now" },
];
// The robot itself: without it, a ghost that hides nothing.
const BODY = { id: "body", key: "b", name: "body", color: "#593399", hint: "the robot; else a ghost that hides nothing" };
// A push is short: its arrow stays for a while, faint (s).
const AFTERGLOW = 0.3;
// Above the floor, so that they do not flicker (m); this and other lengths are for a robot of the size of UT-mu2.
const ABOVE = 0.0012;

// As parts of 1; on a dark ground, brighter.
function colorOf(id, theme) {
  const hex = OVERLAYS.find((overlay) => overlay.id === id).color;
  const parts = [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16) / 255);
  return theme === "dark" ? parts.map((x) => x + 0.32 * (1 - x)) : parts;
}

// Lines, filled polygons and solid shapes of a moment. A solid may say how much of it shows through what is before it.
class Overlays {
  constructor(film, moment, theme, on) {
    Object.assign(this, { film, moment, lines: [], fills: [], solids: [] });
    const color = (id) => colorOf(id, theme);
    if (on.has("support")) this.polygon(moment.support, color("support"), 0.1, 2.5, 1);
    if (on.has("sets")) this.sets(color("sets"));
    if (on.has("footstep")) this.polygon(moment.footstep, color("footstep"), 0.3, 3, 2);
    if (on.has("trail")) {
      this.trail(color("com"), film.com);
      this.trail(color("dcm"), film.dcm);
    }
    if (on.has("contacts")) {
      for (const contact of moment.contacts) {
        if (contact) this.arrow(contact.point, scaled(contact.force, film.robot.metres_per_newton.contacts), color("contacts"), 0.9);
      }
    }
    if (on.has("push")) this.push(color("push"));
    if (on.has("zmpRef")) this.disc(moment.zmpRef, 0.0095, color("zmpRef"), 4);
    if (on.has("zmp")) this.disc(moment.zmp, 0.006, color("zmp"), 5);
    if (on.has("dcm")) this.disc(moment.dcm, 0.0075, color("dcm"), 6);
    if (on.has("com")) {
      const foot = this.disc(moment.com, 0.0075, color("com"), 7);
      this.lines.push([foot, moment.com, [...color("com"), 0.9], 2]);
      // In white, so that it shows in a robot of any colour.
      for (const [part, rgb] of [[0.0135, [1, 1, 1]], [0.011, color("com")]]) {
        const radius = part * film.robot.length;
        this.solids.push(["sphere", { p: moment.com, q: [0, 0, 0, 1] }, [radius, radius, radius], [...rgb, 1], 1]);
      }
    }
  }

  // A place on the floor; layers are one above the other.
  on([x, y], layer) {
    return [x, y, this.film.height(this.moment.slope, x, y) + (ABOVE + 0.0002 * layer) * this.film.robot.length];
  }

  polygon(corners, color, fill, width, layer, edge = 1) {
    const points = corners.map((corner) => this.on(corner, layer));
    points.forEach((point, i) => {
      this.lines.push([point, points[(i + 1) % points.length], [...color, edge], width]);
      if (i > 1) this.fills.push([points[0], points[i - 1], point, [...color, fill]]);
    });
  }

  // Nested, the fastest innermost; the active one filled, over the others.
  sets(color) {
    const { slices, gain } = this.moment;
    slices.forEach((slice, i) => {
      if (i !== gain) this.polygon(slice, color, 0.05, 1.3, 2, 0.6);
    });
    if (gain !== null && slices[gain]) this.polygon(slices[gain], color, 0.34, 2.5, 3);
  }

  disc(at, radius, color, layer) {
    if (!at) return null;
    const size = radius * this.film.robot.length;
    const around = Array.from({ length: 28 }, (_, k) => {
      const angle = (2 * Math.PI * k) / 28;
      return [at[0] + size * Math.cos(angle), at[1] + size * Math.sin(angle)];
    });
    const rim = around.map(([x, y]) => [at[0] + 1.22 * (x - at[0]), at[1] + 1.22 * (y - at[1])]);
    this.polygon(rim, [1, 1, 1], 0.9, 0, layer);
    this.polygon(around, color, 1, 0, layer + 0.5);
    return this.on(at, layer);
  }

  trail(color, path) {
    const every = Math.max(1, Math.round(0.006 / this.film.period));
    let last = null;
    for (let i = 0; i <= this.moment.i; i += every) {
      const at = path(i, 0), point = at && this.on(at, 3.5);
      if (point && last) this.lines.push([last, point, [...color, 0.75], 1.8]);
      last = point;
    }
  }

  push(color) {
    const { film, moment } = this;
    let { push } = moment, alpha = 1;
    for (let i = moment.i; !push && i >= 0 && moment.time - film.time(i) < AFTERGLOW; i--) {
      push = arrow(film.push(i, 0));
      alpha = 0.45 * (1 - (moment.time - film.time(i)) / AFTERGLOW);
    }
    if (!push) return;
    const along = scaled(push.force, this.film.robot.metres_per_newton.push);
    // It pushes: its point is where the force attacks.
    this.arrow(sub(push.point, along), along, color, alpha);
  }

  arrow(from, along, color, alpha) {
    const size = length(along);
    if (size < 1e-4) return;
    const { length: large } = this.film.robot;
    const q = fromZ(along), head = Math.min(0.03 * large, 0.5 * size), thick = 0.0045 * large;
    const at = (share) => add(from, scaled(along, share / size));
    const shaft = (size - head) / 2;
    this.solids.push(["cylinder", { p: at(shaft), q }, [thick, thick, shaft], [...color, alpha]]);
    this.solids.push(["cone", { p: at(size - head / 2), q }, [0.4 * head, 0.4 * head, head / 2], [...color, alpha]]);
  }
}

// Draws lines of some pixels' width, and fills.
class OverlayLayer {
  constructor(gl) {
    this.gl = gl;
    // A line is a rectangle between its ends, turned to the screen: WebGL has lines of one pixel only.
    this.lineProgram = program(gl, `
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
    this.fillProgram = program(gl, `
layout(location = 0) in vec3 here;
layout(location = 1) in vec4 tint;
uniform mat4 view;
out vec4 color;
void main() { color = tint; gl_Position = view * vec4(here, 1.0); }`,
    "in vec4 color; uniform float alpha; out vec4 shown; void main() { shown = vec4(color.rgb, color.a * alpha); }");
    this.lineBuffer = vertices(gl, [3, 3, 4, 1]);
    this.fillBuffer = vertices(gl, [3, 4]);
  }

  draw({ lines, fills }, view, screen, alpha) {
    const ratio = window.devicePixelRatio || 1, lineData = [], fillData = [];
    for (const [a, b, color, width] of lines) {
      const w = width * ratio;
      // Seen from the other end, left is right.
      const from = (side) => [...a, ...b, ...color, side], to = (side) => [...b, ...a, ...color, -side];
      lineData.push(...from(w), ...from(-w), ...to(w), ...to(w), ...from(-w), ...to(-w));
    }
    for (const [a, b, c, color] of fills) fillData.push(...a, ...color, ...b, ...color, ...c, ...color);
    this.batch(this.fillProgram, this.fillBuffer, fillData, 7, view, screen, alpha);
    this.batch(this.lineProgram, this.lineBuffer, lineData, 11, view, screen, alpha);
  }

  batch({ made, uniforms }, { array, buffer }, data, stride, view, screen, alpha) {
    const { gl } = this;
    gl.useProgram(made);
    gl.uniformMatrix4fv(uniforms.view, false, view);
    gl.uniform1f(uniforms.alpha, alpha);
    if (uniforms.screen) gl.uniform2fv(uniforms.screen, screen);
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(data), gl.DYNAMIC_DRAW);
    gl.drawArrays(gl.TRIANGLES, 0, data.length / stride);
  }
}
