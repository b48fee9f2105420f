// The packed film, with columns of 16-bit numbers (see pack.rs), and the kinematics of the robot.

const NONE = 65535;

function numbers(text) {
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0)), view = new DataView(bytes.buffer);
  return Uint16Array.from({ length: bytes.length / 2 }, (_, i) => view.getUint16(2 * i, true));
}

// A function from the index of a moment to its value, or null if it has none, as beyond the end of a short column.
function column({ least, step, data }) {
  if (data === undefined) return () => least;
  const values = numbers(data);
  return (i) => ((values[i] ?? NONE) === NONE ? null : least + step * values[i]);
}

// The same for a column of integers.
const whole = (value) => (i) => (value(i) === null ? null : Math.round(value(i)));

// The same for a vector, interpolated between two moments. If one of them has no value, the nearer moment counts.
function columns(packed) {
  const all = packed.map(column);
  const at = (i) => {
    const values = all.map((value) => value(i));
    return values.includes(null) ? null : values;
  };
  return (i, share) => {
    const here = at(i);
    if (!share) return here;
    const next = at(i + 1);
    return here && next ? here.map((x, k) => x + share * (next[k] - x)) : share < 0.5 ? here : next;
  };
}

// A function from the index of a moment to its polygon, a list of corners.
function polygons({ which, counts, x, y }) {
  const [index, sizes, xs, ys] = [numbers(which), numbers(counts), column(x), column(y)];
  const starts = [0];
  for (const size of sizes) starts.push(starts[starts.length - 1] + size);
  const corners = (ring) => Array.from({ length: sizes[ring] }, (_, k) => [xs(starts[ring] + k), ys(starts[ring] + k)]);
  return (i) => corners(index[i]);
}

// How a robot moves. Only this is known of a ghost.
class Motion {
  constructor(data, links) {
    this.data = data;
    this.count = data.moments;
    this.period = data.period_s;
    this.start = data.start_s;
    this.end = this.start + (this.count - 1) * this.period;
    this.links = links;
    for (const name of ["base", "turn", "q", "com", "zmp"]) this[name] = columns(data[name]);
    this.hanging = data.hanging ? columns(data.hanging) : () => null;
  }

  // The index of the last moment before a time, and the share of the way to the next one (0 to 1).
  index(time) {
    const at = clamp((time - this.start) / this.period, 0, this.count - 1);
    // A time that is within rounding of a moment counts as this moment.
    const near = Math.round(at);
    const exact = Math.abs(at - near) < 1e-6 ? near : at;
    const i = Math.floor(exact);
    return [i, exact - i];
  }

  time(i) {
    return this.start + i * this.period;
  }

  // The poses of all links in the world.
  poses(i, share) {
    const q = this.q(i, share);
    const poses = [{ p: this.base(i, share), q: unit(this.turn(i, share)) }];
    this.links.slice(1).forEach((link, k) => {
      const joint = { p: [0, 0, 0], q: aboutAxis(link.axis, q[k]) };
      poses.push(placed(placed(poses[link.parent], link.origin), joint));
    });
    return poses;
  }

  // The pose of the pendulum in the world, as long as there is one.
  pendulum(i, share) {
    const seven = this.hanging(i, share);
    return seven && { p: seven.slice(0, 3), q: unit(seven.slice(3)) };
  }

  // What is shown of a ghost at a time.
  at(time) {
    const [i, share] = this.index(time), at = { com: this.com(i, share), zmp: this.zmp(i, share) };
    return { i, poses: this.poses(i, share), pendulum: this.pendulum(i, share), ...at };
  }
}

class Film extends Motion {
  constructor(data) {
    super(data, data.robot.links.map((link) => ({
      ...link,
      origin: link.origin && poseOf(link.origin),
      visuals: visualsOf(link.visuals),
    })));
    this.pendulumVisuals = visualsOf(data.pendulum);
    this.gains = data.gains;
    this.events = data.events;
    this.robot = data.robot;
    for (const name of ["slope", "dcm", "zmp_ref", "push"]) this[name] = columns(data[name]);
    for (const name of ["dcm_outside", "margin"]) this[name] = column(data[name]);
    for (const name of ["gain", "phase"]) this[name] = whole(column(data[name]));
    this.contacts = data.contacts.map(columns);
    this.support = polygons(data.support);
    this.slices = data.slices.map(polygons);
    this.footstep = polygons(data.footstep);
    this.ghost = data.ghost && new Motion(data.ghost, this.links);
  }

  // Everything that is shown at a time.
  at(time) {
    const [i, share] = this.index(time);
    const near = share < 0.5 ? i : i + 1;
    return {
      ...super.at(time),
      time,
      ghost: this.ghost && this.ghost.at(time),
      slope: unit(this.slope(i, share)),
      dcm: this.dcm(i, share),
      zmpRef: this.zmp_ref(i, share),
      dcmOutside: this.dcm_outside(near),
      margin: this.margin(near),
      gain: this.gain(near),
      phase: this.data.phases[this.phase(near)],
      push: arrow(this.push(near, 0)),
      contacts: this.contacts.map((contact) => arrow(contact(i, share))),
      support: this.support(near),
      sets: this.slices.map((slice) => slice(near)),
      footstep: this.footstep(near),
    };
  }

  // Height of the ground (m) at a place, with the slope of a moment.
  height(slope, x, y) {
    const normal = turned(slope, [0, 0, 1]), plane = -(normal[0] * x + normal[1] * y) / normal[2];
    const { step_m: step, patch } = this.data.ground;
    if (!step) return plane;
    const local = turned(inverse(slope), [x, y, plane]);
    const inside = local[0] >= patch[0] && local[0] <= patch[2] && local[1] >= patch[1] && local[1] <= patch[3];
    return inside ? plane : plane + step / normal[2];
  }
}

const visualsOf = (visuals) => visuals.map((visual) => ({ ...visual, pose: poseOf(visual.pose) }));
const arrow = (six) => six && { point: six.slice(0, 3), force: six.slice(3) };
