// The marks: COM, ZMP and DCM, the support and the sets, and the forces on the robot.

const OVERLAYS = Object.values(PALETTE.overlays);
// The robot of the second film.
const GHOST = PALETTE.ghost;
const AFTERGLOW = PALETTE.afterglow_s;
// Height of marks above the floor (m, for a robot of the size of UT-mu2), so that they do not flicker.
const ABOVE = 0.0018;

// The colour of an overlay (red, green and blue from 0 to 1), which is brighter on a dark ground.
function colorOf(id, theme) {
  const hex = [...OVERLAYS, GHOST].find((overlay) => overlay.id === id).color;
  const parts = [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16) / 255);
  return theme === "dark" ? parts.map((x) => x + 0.32 * (1 - x)) : parts;
}

// The push that acts or has just ended, and the opacity of its arrow.
function pushAt(film, moment) {
  if (moment.push) return [moment.push, 1];
  for (let i = moment.i; i >= 0 && moment.time - film.time(i) < AFTERGLOW; i--) {
    const push = arrow(film.push(i, 0));
    if (push) return [push, 0.45 * (1 - (moment.time - film.time(i)) / AFTERGLOW)];
  }
  return [null, 0];
}

// The marks of a moment, in the order in which they are drawn: polygons on the floor, signs at points, the plumb line of the
// COM, and arrows. Points are in the world (m), and the style of the overlay says how they look.
function marksOf(film, moment, on) {
  const floor = ([x, y]) => [x, y, film.height(moment.slope, x, y) + ABOVE * film.robot.length];
  const sheet = (corners, sheet) => ({ polygon: corners.map(floor), sheet });
  const shapes = {
    polygon: (corners, style) => [sheet(corners, style.sheet)],
    // The sets are nested with the fastest innermost, and the active one is drawn over the others.
    sets: (slices, { resting, acting }) => {
      const acts = (i) => i === moment.gain;
      return [false, true].flatMap((last) =>
        slices.filter((_, i) => acts(i) === last).map((slice) => sheet(slice, last ? acting : resting)));
    },
    spot: (at, { sign }) => [{ at: floor(at), sign }],
    com: (at, { sign, foot }) => [{ plumb: [at, floor(at)] }, { at: floor(at), sign: foot }, { at, sign }],
    arrow: (forces, { m_per_n: long, ends, width }) => [forces].flat().filter(Boolean).map(({ point, force }) => {
      const along = scaled(force, long / film.robot.stiffness);
      return { arrow: ends ? [sub(point, along), point] : [point, add(point, along)], width };
    }),
  };
  return OVERLAYS.filter(({ id }) => on.has(id)).flatMap(({ id, style }) => {
    const [shown, opacity] = id === "push" ? pushAt(film, moment) : [moment[id], 1];
    return shown ? shapes[style.shape](shown, style).map((mark) => ({ ...mark, id, opacity })) : [];
  });
}

// The marks of the ghost.
function ghostMarks(film, { ghost, slope }, on) {
  const known = new Set(GHOST.marks.filter((id) => on.has(id)));
  return marksOf(film, { ...ghost, slope }, known).map((mark) => ({ ...mark, opacity: GHOST.marks_opacity }));
}

// The fillings of polygons, which lie on the floor, where the robot hides them.
class Fillings {
  constructor(gl) {
    this.gl = gl;
    this.program = program(gl, `
layout(location = 0) in vec3 here;
layout(location = 1) in vec4 tint;
uniform mat4 view;
out vec4 color;
void main() {
  color = tint;
  gl_Position = view * vec4(here, 1.0);
}`, "in vec4 color; out vec4 shown; void main() { shown = color; }");
    this.buffer = vertices(gl, [3, 4]);
  }

  draw(marks, view, theme) {
    const { gl, program: { made, uniforms } } = this, data = [];
    for (const { id, polygon, sheet } of marks.filter((mark) => mark.polygon)) {
      const tint = [...colorOf(id, theme), sheet.fill];
      for (let i = 2; i < polygon.length; i++) for (const k of [0, i - 1, i]) data.push(...polygon[k], ...tint);
    }
    gl.useProgram(made);
    gl.uniformMatrix4fv(uniforms.view, false, view);
    gl.bindVertexArray(this.buffer.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(data), gl.DYNAMIC_DRAW);
    gl.drawArrays(gl.TRIANGLES, 0, data.length / 7);
  }
}

// All other marks, on a canvas over the picture, so that the robot does not hide them.
class Over {
  constructor(canvas) {
    this.canvas = canvas;
    this.pen = canvas.getContext("2d");
    // Pixels for each point of the screen.
    this.ratio = 1;
  }

  draw(film, moment, marks, view, theme, on) {
    const { canvas, pen, ratio } = this, { plumb } = PALETTE;
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, canvas.width / ratio, canvas.height / ratio);
    const [halfWidth, halfHeight] = [canvas.width, canvas.height].map((px) => px / ratio / 2);
    const seen = (point) => {
      const [x, y, , w] = seenFrom(view, point);
      return w > 1e-3 ? [(1 + x / w) * halfWidth, (1 - y / w) * halfHeight] : null;
    };
    const css = (id) => `rgb(${colorOf(id, theme).map((x) => Math.round(255 * x))})`;
    if (on.has("trail")) for (const id of ["com", "dcm"]) this.trail(film, moment, film[id], seen, css(id));
    for (const { id, opacity, polygon, sheet, at, sign, plumb: ends, arrow: arrowEnds, width } of marks) {
      pen.globalAlpha = opacity;
      const color = css(id), points = (polygon ?? ends ?? arrowEnds ?? [at]).map(seen);
      if (points.includes(null)) continue;
      if (polygon) {
        pen.globalAlpha = opacity * sheet.edge;
        this.trace(points, true, color, sheet.width);
      } else if (ends) {
        pen.globalAlpha = opacity * plumb.opacity;
        pen.setLineDash([plumb.dash, plumb.gap]);
        this.trace(points, false, color, plumb.width);
        pen.setLineDash([]);
      } else if (arrowEnds) {
        this.arrow(...points, color, width);
      } else {
        for (const { form, path, width: wide, white } of sign) {
          const there = path.map(([x, y]) => [points[0][0] + x, points[0][1] + y]);
          this.trace(there, form !== "line", white ? "#fff" : color, wide);
        }
      }
    }
    pen.globalAlpha = 1;
  }

  // Draws a line with a width, or an area if there is no width.
  trace(points, closed, color, width) {
    const { pen } = this;
    pen.beginPath();
    for (const point of points) pen.lineTo(...point);
    if (closed) pen.closePath();
    pen.lineJoin = "bevel";
    pen.lineWidth = width;
    pen.fillStyle = pen.strokeStyle = color;
    if (width === undefined) pen.fill();
    else pen.stroke();
  }

  arrow(from, to, color, width) {
    const along = [to[0] - from[0], to[1] - from[1]], size = Math.hypot(...along);
    if (size < 1) return;
    const [x, y] = along.map((v) => v / size), [long, broad] = PALETTE.head.map((share) => share * width);
    const head = Math.min(long, size), half = (0.5 * head * broad) / long, neck = [to[0] - head * x, to[1] - head * y];
    this.trace([from, neck], false, color, width);
    this.trace([to, [neck[0] - half * y, neck[1] + half * x], [neck[0] + half * y, neck[1] - half * x]], true, color);
  }

  // The path of a point over the floor up to now.
  trail(film, moment, path, seen, color) {
    const every = Math.max(1, Math.round(0.006 / film.period)), points = [];
    for (let i = 0; i <= moment.i; i += every) {
      const [x, y] = path(i, 0), at = seen([x, y, film.height(moment.slope, x, y)]);
      if (at) points.push(at);
    }
    const { width, opacity } = PALETTE.overlays.trail.style;
    this.pen.globalAlpha = opacity;
    this.trace(points, false, color, width);
  }
}
