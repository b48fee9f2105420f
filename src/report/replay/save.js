// What the page saves of what it shows: the view as it is (PNG), a strip of stills (PNG), and a film (GIF or WebM). The last
// two have a fixed size and frames by simulated time, so that the same page gives the same bytes again; a WebM has the times and
// the code of the browser.

const STILLS = 6, STILL = [240, 320], FRAME = [480, 360], RECORDED = [960, 720];
// Time for which a frame of a film is shown, and the last one (1/100 s); most frames; frames of which the colours are learned.
const FRAME_CS = 4, LAST_CS = 120, MOST_FRAMES = 240, LEARNED = 12;
// Time that strips and films go on after the last event (s).
const REST = 0.2;

// The picture of a time in a size (pixels), with the time at its top and the phase at its bottom.
function picture(time, [width, height], speed = 1) {
  const { canvas, over } = scene, moment = film.at(time), made = document.createElement("canvas");
  for (const layer of [canvas, over.canvas, made]) {
    if (layer.width !== width || layer.height !== height) [layer.width, layer.height] = [width, height];
  }
  scene.draw(moment, camera, theme(), shown);
  const pen = made.getContext("2d", { willReadFrequently: true });
  pen.drawImage(canvas, 0, 0);
  pen.drawImage(over.canvas, 0, 0);
  pen.font = `600 ${14 * over.ratio}px system-ui, sans-serif`;
  pen.lineWidth = 4 * over.ratio;
  const dark = theme() === "dark", words = [time.toFixed(2) + " s" + (speed === 1 ? "" : ` (${speed} \u00d7)`), moment.phase.doing];
  [pen.strokeStyle, pen.fillStyle] = dark ? ["#000", "#fff"] : ["#fff", "#1f2328"];
  words.forEach((text, i) => {
    const place = [10 * over.ratio, i ? height - 12 * over.ratio : 20 * over.ratio];
    pen.strokeText(text, ...place);
    pen.fillText(text, ...place);
  });
  return made;
}

// The time soon after which nothing more happens, if that is after the present moment.
function ending() {
  const last = Math.max(...film.events.map(({ to_s: to }) => to)) + REST;
  return last > state.time ? Math.min(last, film.end) : film.end;
}

// Equally distant times from the present moment to the ending, both included.
const times = (count) => Array.from({ length: count }, (_, i) => state.time + ((ending() - state.time) * i) / Math.max(count - 1, 1));

// The times of the pictures of a film at the speed of the player; faster, if there would be too many.
function frames() {
  const count = Math.round((ending() - state.time) / (0.01 * FRAME_CS * state.speed));
  return times(clamp(count, 1, MOST_FRAMES) + 1);
}

const SAVES = {
  png: () => picture(state.time, [find("view").width, find("view").height]).toDataURL("image/png"),

  strip: () => {
    const [width, height] = STILL, made = document.createElement("canvas"), pen = made.getContext("2d");
    [made.width, made.height] = [STILLS * width, height];
    scene.over.ratio = 0.7;
    times(STILLS).forEach((time, i) => {
      pen.drawImage(picture(time, STILL), i * width, 0);
      pen.fillStyle = "#fff";
      if (i) pen.fillRect(i * width - 1, 0, 2, height);
    });
    return made.toDataURL("image/png");
  },

  film: async () => {
    scene.over.ratio = 1;
    const { speed } = state, all = frames();
    const pixels = (time) => picture(time, FRAME, speed).getContext("2d").getImageData(0, 0, ...FRAME).data;
    const some = all.filter((_, i) => i % Math.ceil(all.length / LEARNED) === 0);
    const marks = [...OVERLAYS, GHOST].map(({ id }) => colorOf(id, theme()).map((x) => Math.round(255 * x)));
    const gif = new Gif(...FRAME, paletteOf(some.map(pixels), [...marks, [255, 255, 255]]));
    for (const [i, time] of all.entries()) {
      gif.add(pixels(time), i === all.length - 1 ? LAST_CS : FRAME_CS);
      say(`film: ${i + 1} of ${all.length} pictures`);
      // The page stays alive between two frames.
      await new Promise((done) => setTimeout(done));
    }
    return gif.address();
  },
};

if (window.MediaRecorder?.isTypeSupported("video/webm")) SAVES.webm = async () => {
  scene.over.ratio = 2;
  const { speed } = state, all = frames(), parts = [], made = document.createElement("canvas");
  [made.width, made.height] = RECORDED;
  const pen = made.getContext("2d"), stream = made.captureStream(0), [track] = stream.getVideoTracks();
  const recorder = new MediaRecorder(stream, { mimeType: "video/webm", videoBitsPerSecond: 8e6 });
  const ended = new Promise((done) => { recorder.onstop = done; });
  recorder.ondataavailable = ({ data }) => parts.push(data);
  recorder.start();
  for (const [i, time] of all.entries()) {
    // The browser stamps pictures by its own clock, which stands still while one is drawn.
    recorder.pause();
    pen.drawImage(picture(time, RECORDED, speed), 0, 0);
    say(`film: ${i + 1} of ${all.length} pictures`);
    recorder.resume();
    (track.requestFrame ? track : stream).requestFrame();
    await new Promise((done) => setTimeout(done, 10 * (i === all.length - 1 ? LAST_CS : FRAME_CS)));
  }
  recorder.stop();
  await ended;
  const reader = new FileReader();
  reader.readAsDataURL(new Blob(parts, { type: "video/webm" }));
  await new Promise((done) => { reader.onload = done; });
  return reader.result;
};

// Saves a kind. A person gets a download; a script finds it in the page, as the link `saved`.
async function save(kind, click) {
  if (!scene || !SAVES[kind] || state.saving) return;
  pause();
  state.saving = true;
  let href;
  try {
    href = await SAVES[kind]();
  } finally {
    state.saving = false;
    resize();
  }
  const saved = Object.assign(document.createElement("a"), { id: "saved", href });
  saved.download = saved.textContent = document.title.replace(/[^\w.]+/g, "-").slice(0, 60) + ({ film: ".gif", webm: ".webm" }[kind] ?? ".png");
  say("saved: ");
  find("toast").append(saved);
  if (click) saved.click();
}

// At most 255 colours for pictures: those of the marks, and the others by median cut. A colour counts as the square root of
// its number of pixels, so that the floor leaves some to the robot.
function paletteOf(pictures, marks) {
  const counts = new Map();
  for (const data of pictures) {
    for (let i = 0; i < data.length; i += 4) {
      const key = ((data[i] >> 3) << 10) | ((data[i + 1] >> 3) << 5) | (data[i + 2] >> 3);
      counts.set(key, (counts.get(key) ?? 0) + 1);
    }
  }
  const box = (colors) => {
    const spread = (axis) => Math.max(...colors.map((c) => c[axis])) - Math.min(...colors.map((c) => c[axis]));
    const spreads = [0, 1, 2].map(spread), weight = colors.reduce((sum, c) => sum + c[3], 0), widest = Math.max(...spreads);
    return { colors, weight, axis: spreads.indexOf(widest), worth: colors.length > 1 ? widest * weight : 0 };
  };
  const middle = (bits) => 8 * (bits & 31) + 4;
  let boxes = [box([...counts].map(([key, n]) => [middle(key >> 10), middle(key >> 5), middle(key), Math.sqrt(n)]))];
  while (boxes.length + marks.length < 255) {
    const { colors, weight, axis, worth } = boxes.reduce((a, b) => (b.worth > a.worth ? b : a));
    if (!worth) break;
    colors.sort((a, b) => a[axis] - b[axis]);
    let at = 0, sum = 0;
    do sum += colors[at++][3]; while (sum < weight / 2 && at < colors.length - 1);
    boxes = boxes.filter((one) => one.colors !== colors);
    boxes.push(box(colors.slice(0, at)), box(colors.slice(at)));
  }
  const mean = ({ colors, weight }) => [0, 1, 2].map((i) => Math.round(colors.reduce((sum, c) => sum + c[i] * c[3], 0) / weight));
  return [...marks, ...boxes.map(mean)];
}

// A GIF that repeats for ever. Pixels that do not change have the colour after the last one, which is transparent.
class Gif {
  constructor(width, height, colors) {
    Object.assign(this, { width, height, colors, before: null, nearest: new Int16Array(1 << 18).fill(-1), parts: [] });
    const table = colors.flat().concat(Array(3 * (256 - colors.length)).fill(0));
    const twice = [width, height].flatMap(this.two);
    this.put([..."GIF89a"].map((c) => c.charCodeAt()), twice, [0xf7, 0, 0], table);
    this.put([0x21, 0xff, 11], [..."NETSCAPE2.0"].map((c) => c.charCodeAt()), [3, 1, 0, 0, 0]);
  }

  put(...bytes) {
    this.parts.push(...bytes.map((part) => Uint8Array.from(part)));
  }

  two(x) {
    return [x & 255, x >> 8];
  }

  index(r, g, b) {
    const key = ((r >> 2) << 12) | ((g >> 2) << 6) | (b >> 2);
    if (this.nearest[key] < 0) {
      let least = Infinity;
      this.colors.forEach(([x, y, z], i) => {
        const away = (r - x) ** 2 + (g - y) ** 2 + (b - z) ** 2;
        if (away < least) [least, this.nearest[key]] = [away, i];
      });
    }
    return this.nearest[key];
  }

  // Adds a picture that is shown for a time (1/100 s).
  add(data, delay) {
    const now = new Uint8Array(data.length / 4), { before } = this;
    for (let i = 0; i < now.length; i++) now[i] = this.index(data[4 * i], data[4 * i + 1], data[4 * i + 2]);
    const size = [this.width, this.height].flatMap(this.two);
    this.put([0x21, 0xf9, 4, before ? 5 : 4, ...this.two(delay), 255, 0], [0x2c, 0, 0, 0, 0, ...size, 0, 8]);
    const packed = this.packed(before ? now.map((index, i) => (index === before[i] ? 255 : index)) : now);
    for (let at = 0; at < packed.length; at += 255) {
      const block = packed.slice(at, at + 255);
      this.put([block.length], block);
    }
    this.put([0]);
    this.before = now;
  }

  // Indices in the code of Lempel, Ziv and Welch.
  packed(indices) {
    const bytes = [], known = new Map();
    let wide = 9, next = 258, held = 0, bits = 0, prefix = indices[0];
    const code = (value) => {
      held |= value << bits;
      for (bits += wide; bits >= 8; bits -= 8, held >>>= 8) bytes.push(held & 255);
    };
    code(256);
    for (let i = 1; i < indices.length; i++) {
      const key = (prefix << 8) | indices[i], longer = known.get(key);
      if (longer !== undefined) {
        prefix = longer;
        continue;
      }
      code(prefix);
      if (next === 4096) {
        code(256);
        known.clear();
        [wide, next] = [9, 258];
      } else {
        if (next === 1 << wide) wide++;
        known.set(key, next++);
      }
      prefix = indices[i];
    }
    code(prefix);
    code(257);
    if (bits) bytes.push(held & 255);
    return bytes;
  }

  address() {
    this.put([0x3b]);
    const text = this.parts.map((part) => {
      let piece = "";
      for (const byte of part) piece += String.fromCharCode(byte);
      return piece;
    });
    return "data:image/gif;base64," + btoa(text.join(""));
  }
}
