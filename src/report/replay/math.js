// Vectors are arrays of three, quaternions are [x, y, z, w], poses are { p, q }, and matrices are 4 x 4 by columns, as in WebGL.
const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const scaled = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const length = (a) => Math.hypot(...a);
const unit = (a) => {
  const size = Math.hypot(...a) || 1;
  return a.map((x) => x / size);
};
const clamp = (x, least, most) => Math.min(Math.max(x, least), most);

function turned(q, v) {
  const u = [q[0], q[1], q[2]], t = scaled(cross(u, v), 2);
  return add(add(v, scaled(t, q[3])), cross(u, t));
}

// Applies first b, then a.
function quaternionProduct(a, b) {
  const [ax, ay, az, aw] = a, [bx, by, bz, bw] = b;
  return [
    aw * bx + ax * bw + ay * bz - az * by,
    aw * by - ax * bz + ay * bw + az * bx,
    aw * bz + ax * by - ay * bx + az * bw,
    aw * bw - ax * bx - ay * by - az * bz,
  ];
}

const inverse = (q) => [-q[0], -q[1], -q[2], q[3]];

function aboutAxis(axis, angle) {
  const s = Math.sin(angle / 2);
  return [axis[0] * s, axis[1] * s, axis[2] * s, Math.cos(angle / 2)];
}

const placed = (a, b) => ({ p: add(a.p, turned(a.q, b.p)), q: quaternionProduct(a.q, b.q) });
const poseOf = (seven) => ({ p: seven.slice(0, 3), q: seven.slice(3) });

function matrixOf({ p, q }) {
  const x = turned(q, [1, 0, 0]), y = turned(q, [0, 1, 0]), z = turned(q, [0, 0, 1]);
  return [...x, 0, ...y, 0, ...z, 0, ...p, 1];
}

// Applies first b, then a.
const product = (a, b) => [...new DOMMatrix(a).multiply(new DOMMatrix(b)).toFloat64Array()];

// A point in the homogeneous coordinates of a view (a matrix).
const seenFrom = (view, [x, y, z]) => [0, 1, 2, 3].map((i) => view[i] * x + view[4 + i] * y + view[8 + i] * z + view[12 + i]);

function perspective(angle, aspect, near, far) {
  const f = 1 / Math.tan(angle / 2), depth = 1 / (near - far);
  return [f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) * depth, -1, 0, 0, 2 * far * near * depth, 0];
}

function lookingAt(eye, target, up) {
  const z = unit(sub(eye, target)), x = unit(cross(up, z)), y = cross(z, x);
  return [x[0], y[0], z[0], 0, x[1], y[1], z[1], 0, x[2], y[2], z[2], 0, -dot(x, eye), -dot(y, eye), -dot(z, eye), 1];
}
