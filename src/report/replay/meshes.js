// Small helpers for WebGL 2.

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

// A buffer of floats, with attributes of the given sizes at the locations 0, 1, ...
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

// The shapes of solids (see pack.rs) as triangles with point and normal. Each shape fills the cube from -1 to 1.
function shapes(gl, packed) {
  return Object.fromEntries(Object.entries(packed).map(([name, { corners, faces }]) => {
    const values = Array.from(numbers(corners), (n) => n / 32767 - 1);
    const data = [...numbers(faces)].flatMap((corner) => values.slice(6 * corner, 6 * corner + 6));
    return [name, { ...vertices(gl, [3, 3], data), count: data.length / 6 }];
  }));
}
