// Draws a moment: the floor, the shadow, the robot, and the marks of overlays.js.

// Unit vector towards the light.
const LIGHT = unit([0.35, 0.5, 1.1]);
// Size of the texture of the shadow (pixels), and half the size of the floor that it covers (m, for a robot of the size of
// UT-mu2).
const SHADOW_PX = 1024, SHADOW_HALF = 0.9;

const THEMES = {
  light: { back: [0.93, 0.945, 0.96], floor: [0.985, 0.988, 0.992], line: [0.62, 0.67, 0.73], shade: 0.42, ambient: 0.62 },
  dark: { back: [0.075, 0.088, 0.105], floor: [0.155, 0.175, 0.2], line: [0.36, 0.41, 0.47], shade: 0.62, ambient: 0.5 },
};

const SOLID_VERTEX = `
layout(location = 0) in vec3 point;
layout(location = 1) in vec3 normal;
uniform mat4 view, pose;
uniform vec3 size;
out vec3 outward, place;
void main() {
  outward = mat3(pose) * normalize(normal / size);
  vec4 world = pose * vec4(point * size, 1.0);
  place = world.xyz;
  gl_Position = view * world;
}`;
// Light by Lambert's law, with ambient light that is weaker from below. Colours are mixed as linear light.
const SOLID_FRAGMENT = `
in vec3 outward, place;
uniform vec4 color;
uniform vec3 light, eye;
uniform float ambient;
out vec4 shown;
void main() {
  vec3 n = normalize(outward), v = normalize(eye - place);
  float key = max(dot(n, light), 0.0), sky = 0.5 + 0.5 * n.z;
  float gloss = pow(max(dot(n, normalize(light + v)), 0.0), 40.0);
  float rim = pow(1.0 - max(dot(n, v), 0.0), 3.0);
  vec3 base = pow(color.rgb, vec3(2.2));
  vec3 lit = base * (ambient * mix(0.45, 1.0, sky) + 0.75 * key) + 0.10 * gloss + 0.05 * rim * sky;
  shown = vec4(pow(lit, vec3(1.0 / 2.2)), color.a);
}`;
// Projects the robot along the light onto the floor. z keeps the height above the floor.
const SHADOW_VERTEX = `
layout(location = 0) in vec3 point;
uniform mat4 pose, floor_from_world;
uniform vec3 size, light;
uniform vec2 middle;
uniform float reach, large;
out float height;
void main() {
  vec3 p = (floor_from_world * pose * vec4(point * size, 1.0)).xyz;
  height = max(p.z, 0.0) / large;
  gl_Position = vec4((p.xy - light.xy / light.z * p.z - middle) / reach, min(height, 1.9) - 0.95, 1.0);
}`;
const SHADOW_FRAGMENT = `
in float height;
out vec4 shown;
void main() { shown = vec4(1.0, min(height, 1.0), 0.0, 1.0); }`;
const FLOOR_VERTEX = `
layout(location = 0) in vec3 point;
uniform mat4 view, world_from_floor;
out vec3 place, local;
void main() {
  vec4 world = world_from_floor * vec4(point, 1.0);
  local = point;
  place = world.xyz;
  gl_Position = view * world;
}`;
// The floor has a grid of 0.1 m with stronger lines each 0.5 m, and the axes x and y. Walls have no lines (lined is 0), since
// x or y is constant there. A shadow is softer the higher the part is that throws it.
const FLOOR_FRAGMENT = `
in vec3 place, local;
uniform vec3 back, ground, line, eye;
uniform vec2 middle;
uniform float reach, large, shade, sunk, lined;
uniform sampler2D shadow;
out vec4 shown;
float grid(float period, float px) {
  vec2 at = local.xy / period, wide = fwidth(at);
  vec2 near = abs(fract(at - 0.5) - 0.5) / max(wide, vec2(1e-6));
  vec2 fading = clamp(0.4 / wide - 1.0, 0.0, 1.0);
  vec2 drawn = clamp(px - near, 0.0, 1.0) * fading;
  return max(drawn.x, drawn.y);
}
float axis(float across) { return clamp(1.4 - abs(across) / fwidth(across), 0.0, 1.0); }
// Places that are spread evenly over a disc.
vec2 ring(int i, int count) {
  float angle = 2.39996 * float(i);
  return sqrt((float(i) + 0.5) / float(count)) * vec2(cos(angle), sin(angle));
}
void main() {
  vec3 color = mix(ground, line, lined * (0.30 * grid(0.1, 1.0) + 0.55 * grid(0.5, 1.2)));
  color = mix(color, vec3(0.80, 0.27, 0.24), lined * 0.55 * axis(local.y) * step(0.0, local.x));
  color = mix(color, vec3(0.18, 0.60, 0.30), lined * 0.55 * axis(local.x) * step(0.0, local.y));
  color *= 1.0 - sunk;
  vec2 uv = (local.xy - middle) / reach * 0.5 + 0.5;
  float dark = 0.0;
  if (all(greaterThan(uv, vec2(0.0))) && all(lessThan(uv, vec2(1.0)))) {
    vec2 around = vec2(0.0);
    for (int i = 0; i < 6; i++) around += textureLod(shadow, uv + ring(i, 6) * 0.035, 4.5).rg;
    float px = clamp(90.0 * around.g / max(around.r, 0.02), 2.0, 40.0);
    for (int i = 0; i < 20; i++) {
      dark += textureLod(shadow, uv + ring(i, 20) * px / ${SHADOW_PX}.0, log2(px / 2.0)).r / 20.0;
    }
    vec2 edge = smoothstep(vec2(0.0), vec2(0.08), uv) * smoothstep(vec2(0.0), vec2(0.08), 1.0 - uv);
    // Without parts nearby that throw the shadow its softness is unknown, so it fades out.
    dark *= edge.x * edge.y * smoothstep(0.0, 0.15, around.r);
  }
  color *= 1.0 - shade * dark;
  float far = length(local.xy - middle) / large;
  shown = vec4(mix(color, back, smoothstep(0.6, 2.0, far)), 1.0);
}`;

class Scene {
  // Throws an error if the browser has no WebGL 2.
  constructor(canvas, over, film) {
    const gl = canvas.getContext("webgl2", { antialias: true, alpha: false });
    if (!gl) throw new Error("this browser lacks WebGL 2, or has it switched off");
    // `large` is the length of the robot as a multiple of UT-mu2's.
    Object.assign(this, { canvas, film, gl, shapes: shapes(gl, film.data.shapes), large: film.robot.length });
    this.solid = program(gl, SOLID_VERTEX, SOLID_FRAGMENT);
    this.cast = program(gl, SHADOW_VERTEX, SHADOW_FRAGMENT);
    this.floor = program(gl, FLOOR_VERTEX, FLOOR_FRAGMENT);
    this.floorMesh = this.makeFloor();
    this.fillings = new Fillings(gl);
    this.over = new Over(over);
    this.makeShadow();
  }

  makeShadow() {
    const { gl } = this;
    this.texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    gl.texStorage2D(gl.TEXTURE_2D, 8, gl.RGBA8, SHADOW_PX, SHADOW_PX);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR_MIPMAP_LINEAR);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);
    const depth = gl.createRenderbuffer();
    gl.bindRenderbuffer(gl.RENDERBUFFER, depth);
    gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH_COMPONENT16, SHADOW_PX, SHADOW_PX);
    this.target = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.target);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, this.texture, 0);
    gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, depth);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  }

  makeFloor() {
    const { faces } = this.film.data.ground;
    const data = faces.flatMap(([, [a, b, c, d]]) => [a, b, c, a, c, d].flat());
    return { ...vertices(this.gl, [3], data), parts: faces.map(([part]) => part) };
  }

  use({ made, uniforms }, values) {
    const { gl } = this;
    gl.useProgram(made);
    for (const [name, value] of Object.entries(values)) {
      const at = uniforms[name];
      if (typeof value === "number") gl.uniform1f(at, value);
      else if (value.length === 16) gl.uniformMatrix4fv(at, false, value);
      else gl["uniform" + value.length + "fv"](at, value);
    }
    return uniforms;
  }

  // Draws a shape with the program in use.
  shape(uniforms, kind, pose, size, color) {
    const { gl } = this, mesh = this.shapes[kind];
    gl.bindVertexArray(mesh.array);
    gl.uniformMatrix4fv(uniforms.pose, false, matrixOf(pose));
    gl.uniform3fv(uniforms.size, size);
    if (color) gl.uniform4fv(uniforms.color, color);
    gl.drawArrays(gl.TRIANGLES, 0, mesh.count);
  }

  // The shapes of a robot and of the pendulum that strikes it, opaque ones first.
  solids({ poses, pendulum }) {
    const at = (pose) => ({ shape, pose: there, color }) => [shape.kind, placed(pose, there), shape.half, color];
    const all = this.film.links.flatMap((link, i) => link.visuals.map(at(poses[i])));
    if (pendulum) all.push(...this.film.pendulumVisuals.map(at(pendulum)));
    return all.sort((a, b) => b[3][3] - a[3][3]);
  }

  // Draws a transparent robot. It shows only its nearest surface, so its depth is drawn first, and then its colour.
  transparent(uniforms, solids, colorOf) {
    const { gl } = this;
    for (const visible of [false, true]) {
      gl.colorMask(visible, visible, visible, visible);
      gl.depthFunc(visible ? gl.EQUAL : gl.LESS);
      for (const [kind, pose, size, color] of solids) this.shape(uniforms, kind, pose, size, colorOf(color));
    }
  }

  draw(moment, camera, theme, overlays) {
    const { gl, canvas } = this, colors = THEMES[theme];
    const solids = this.solids(moment);
    const tilt = { p: [0, 0, 0], q: moment.slope }, upright = { p: [0, 0, 0], q: inverse(moment.slope) };
    const light = unit(turned(upright.q, LIGHT)), com = turned(upright.q, moment.com);
    const middle = com.slice(0, 2).map((x, i) => x - (0.6 * com[2] * light[i]) / light[2]), { large } = this, reach = SHADOW_HALF * large;

    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.CULL_FACE);
    gl.disable(gl.BLEND);
    gl.depthFunc(gl.LESS);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.target);
    gl.viewport(0, 0, SHADOW_PX, SHADOW_PX);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    // Flat shapes have no outside, so both sides are drawn.
    gl.disable(gl.CULL_FACE);
    const cast = this.use(this.cast, { floor_from_world: matrixOf(upright), light, middle, reach, large });
    for (const [kind, pose, size] of solids) this.shape(cast, kind, pose, size);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    gl.generateMipmap(gl.TEXTURE_2D);

    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(...colors.back, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const { view, eye } = camera.look(canvas.width / canvas.height, moment.com);
    const floor = { view, eye, middle, reach, large, world_from_floor: matrixOf(tilt), back: colors.back, ground: colors.floor };
    const ground = this.use(this.floor, { ...floor, line: colors.line, shade: colors.shade });
    gl.bindVertexArray(this.floorMesh.array);
    this.floorMesh.parts.forEach((part, i) => {
      gl.uniform1f(ground.sunk, part === "around" ? 0 : 0.07);
      gl.uniform1f(ground.lined, part === "wall" ? 0 : 1);
      gl.drawArrays(gl.TRIANGLES, 6 * i, 6);
    });

    gl.enable(gl.CULL_FACE);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    const lit = { view, eye, light: LIGHT, ambient: colors.ambient };
    const uniforms = this.use(this.solid, lit);
    if (overlays.has("body")) {
      for (const solid of solids) this.shape(uniforms, ...solid);
    } else {
      this.transparent(uniforms, solids, (color) => [...color.slice(0, 3), PALETTE.overlays.body.style.opacity]);
      gl.clear(gl.DEPTH_BUFFER_BIT);
    }

    gl.disable(gl.CULL_FACE);
    gl.depthMask(false);
    gl.depthFunc(gl.LEQUAL);
    let marks = marksOf(this.film, moment, overlays);
    this.fillings.draw(marks, view, theme);
    gl.depthMask(true);
    if (moment.ghost && overlays.has(GHOST.id)) {
      // Where both robots are in the same place, the solid one is seen.
      gl.enable(gl.CULL_FACE);
      gl.enable(gl.POLYGON_OFFSET_FILL);
      gl.polygonOffset(1, 4);
      const color = [...colorOf(GHOST.id, theme), GHOST.style.opacity];
      this.transparent(this.use(this.solid, lit), this.solids(moment.ghost), () => color);
      gl.disable(gl.POLYGON_OFFSET_FILL);
      marks = [...ghostMarks(this.film, moment, overlays), ...marks];
    }
    this.over.draw(this.film, moment, marks, view, theme, overlays);
  }
}
