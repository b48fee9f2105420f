// Small helpers for WebGL 2, and the shapes that a robot is made of. Each shape fills the cube from -1 to 1.

function program(gl, vertex, fragment) {
  const made = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, "#version 300 es\nprecision highp float;\n" + source);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(made, shader);
  }
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
  const uniforms = {};
  for (let i = 0; i < gl.getProgramParameter(made, gl.ACTIVE_UNIFORMS); i++) {
    const { name } = gl.getActiveUniform(made, i);
    uniforms[name] = gl.getUniformLocation(made, name);
  }
  return { made, uniforms };
}

// Floats in a buffer, with attributes of the given sizes at the locations 0, 1, ...
function vertices(gl, sizes, data) {
  const array = gl.createVertexArray(), buffer = gl.createBuffer(), stride = 4 * sizes.reduce((a, b) => a + b);
  gl.bindVertexArray(array);
  gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
  if (data) gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(data), gl.STATIC_DRAW);
  let offset = 0;
  sizes.forEach((size, location) => {
    gl.enableVertexAttribArray(location);
    gl.vertexAttribPointer(location, size, gl.FLOAT, false, stride, offset);
    offset += 4 * size;
  });
  return { array, buffer };
}

// A surface of revolution about z through rings { r, z, normal: [radial, along z] }, as triangles: point, normal.
function revolved(rings, around) {
  const data = [];
  const corner = ({ r, z, normal }, k) => {
    const angle = (2 * Math.PI * k) / around, c = Math.cos(angle), s = Math.sin(angle);
    return [r * c, r * s, z, normal[0] * c, normal[0] * s, normal[1]];
  };
  for (let i = 0; i + 1 < rings.length; i += 2) {
    for (let k = 0; k < around; k++) {
      const [a, b] = [rings[i], rings[i + 1]];
      data.push(...corner(a, k), ...corner(a, k + 1), ...corner(b, k + 1), ...corner(a, k), ...corner(b, k + 1), ...corner(b, k));
    }
  }
  return data;
}

function boxShape() {
  const data = [];
  for (let axis = 0; axis < 3; axis++) {
    for (const side of [1, -1]) {
      // Counter-clockwise, seen from outside.
      for (const [u, v] of [[-1, -1], [1, -1], [1, 1], [-1, -1], [1, 1], [-1, 1]]) {
        const point = [0, 0, 0], normal = [0, 0, 0];
        point[axis] = normal[axis] = side;
        point[(axis + 1) % 3] = u * side;
        point[(axis + 2) % 3] = v;
        data.push(...point, ...normal);
      }
    }
  }
  return data;
}

function shapes(gl) {
  const flat = (z) => [0, Math.sign(z)], bands = [];
  for (let i = 0; i < 12; i++) {
    for (const at of [i, i + 1]) {
      const angle = Math.PI * (at / 12 - 0.5), r = Math.cos(angle), z = Math.sin(angle);
      bands.push({ r, z, normal: [r, z] });
    }
  }
  const caps = (r, z) => [{ r: z > 0 ? r : 0, z, normal: flat(z) }, { r: z > 0 ? 0 : r, z, normal: flat(z) }];
  const cylinder = [{ r: 1, z: -1, normal: [1, 0] }, { r: 1, z: 1, normal: [1, 0] }, ...caps(1, 1), ...caps(1, -1)];
  const cone = [{ r: 1, z: -1, normal: [0.9, 0.44] }, { r: 0, z: 1, normal: [0.9, 0.44] }, ...caps(1, -1)];
  const made = { box: boxShape(), cylinder: revolved(cylinder, 40), sphere: revolved(bands, 28), cone: revolved(cone, 28) };
  return Object.fromEntries(Object.entries(made).map(([name, data]) => {
    return [name, { ...vertices(gl, [3, 3], data), count: data.length / 6 }];
  }));
}
