// A camera that orbits a point. A drag turns it, a drag with shift (or with two fingers) moves it, and the wheel (or two
// fingers) zooms. When the view has the keyboard focus, arrow keys turn, arrow keys with shift move, and + and - zoom.

const FIELD = (32 * Math.PI) / 180;
// Distance of the COM from home at which the camera begins to follow (COM heights).
const LEASH = 0.4;
// Direction from the robot, which faces x, to the eye: azimuth and elevation (degrees).
const VIEWS = { home: [38, 18], front: [0, 6], side: [-90, 6], top: [180, 89.5] };

class Camera {
  constructor(canvas, height, changed) {
    Object.assign(this, { canvas, height, changed, fingers: new Map() });
    this.set("home");
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      this.fingers.set(event.pointerId, [event.clientX, event.clientY]);
    });
    canvas.addEventListener("pointermove", (event) => this.drag(event));
    for (const end of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(end, (event) => this.fingers.delete(event.pointerId));
    }
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoom(Math.exp(0.0012 * clamp(event.deltaY * (event.deltaMode ? 30 : 1), -300, 300)));
    }, { passive: false });
    canvas.addEventListener("keydown", (event) => this.press(event));
    // A click does not give the view the focus, so that the arrow keys still control the time.
    canvas.addEventListener("mousedown", (event) => {
      event.preventDefault();
      document.activeElement.blur();
    });
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("dblclick", () => this.set("home"));
  }

  set(view) {
    [this.azimuth, this.elevation] = VIEWS[view].map((deg) => (deg * Math.PI) / 180);
    // The robot is about twice as high as its COM.
    this.target = [0, 0, 0.8 * this.height];
    this.distance = 5.4 * this.height;
    this.changed();
  }

  zoom(factor) {
    this.distance = clamp(this.distance * factor, 0.8 * this.height, 30 * this.height);
    this.changed();
  }

  outward() {
    const { azimuth: a, elevation: e } = this;
    return [Math.cos(e) * Math.cos(a), Math.cos(e) * Math.sin(a), Math.sin(e)];
  }

  drag(event) {
    const before = this.fingers.get(event.pointerId);
    if (!before) return;
    const now = [event.clientX, event.clientY], moved = [now[0] - before[0], now[1] - before[1]];
    const others = [...this.fingers].filter(([id]) => id !== event.pointerId);
    this.fingers.set(event.pointerId, now);
    if (others.length) {
      const other = others[0][1], gap = (p) => Math.hypot(p[0] - other[0], p[1] - other[1]);
      this.distance *= clamp(gap(before) / Math.max(gap(now), 1), 0.8, 1.25);
      // Each of the two fingers contributes half.
      this.pan(moved[0] / 2, moved[1] / 2);
      this.zoom(1);
    } else if (event.shiftKey || event.buttons & 6) {
      this.pan(...moved);
    } else {
      this.turn(...moved);
    }
    this.changed();
  }

  press(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    const zooms = { "+": 0.9, "=": 0.9, "-": 1 / 0.9 };
    const [right, down] = arrows[event.key] ?? [0, 0];
    if (zooms[event.key]) this.zoom(zooms[event.key]);
    else if (!arrows[event.key]) return;
    else if (event.shiftKey) this.pan(20 * right, 20 * down);
    else this.turn(15 * right, 15 * down);
    event.preventDefault();
    event.stopPropagation();
    this.changed();
  }

  turn(right, down) {
    this.azimuth -= 0.008 * right;
    this.elevation = clamp(this.elevation + 0.008 * down, -0.1, 1.562);
  }

  // Moves the view by pixels, so that the point under the finger stays there.
  pan(right, down) {
    const metres = (2 * this.distance * Math.tan(FIELD / 2)) / this.canvas.clientHeight;
    const x = unit(cross([0, 0, 1], this.outward())), y = cross(this.outward(), x);
    this.target = add(this.target, add(scaled(x, -right * metres), scaled(y, down * metres)));
  }

  // How far the camera has followed the COM.
  dragged(com) {
    const away = sub(com, [0, 0, this.height]), far = length(away);
    return scaled(away, Math.max(0, 1 - (LEASH * this.height) / (far || 1)));
  }

  look(aspect, com) {
    // On a narrow screen, the robot has to fit the width.
    const distance = this.distance * Math.max(1, 0.8 / aspect);
    const target = add(this.target, this.dragged(com)), eye = add(target, scaled(this.outward(), distance));
    const lens = perspective(FIELD, aspect, 0.05 * distance, 12 * distance);
    return { view: product(lens, lookingAt(eye, target, [0, 0, 1])), eye };
  }
}
