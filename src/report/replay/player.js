// The player: time, controls and keys for film, scene and plots.

const find = (id) => document.getElementById(id);
const film = new Film(JSON.parse(find("film").textContent));
const dark = matchMedia("(prefers-color-scheme: dark)");
const theme = () => (dark.matches ? "dark" : "light");
const toggles = [...OVERLAYS];
if (film.ghost) toggles.push({ ...GHOST, name: "ghost: " + film.data.ghost.name });
const shown = new Set(toggles.map((overlay) => overlay.id));
const state = { time: film.start, playing: false, speed: 1, stale: true, last: 0 };

let scene = null, camera = null;
try {
  const canvas = find("view"), over = find("over");
  scene = new Scene(canvas, over, film);
  camera = new Camera(canvas, film.robot.com_height_m, () => { state.stale = true; });
  // A mobile browser takes the graphics context from a page in the background.
  canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
  canvas.addEventListener("webglcontextrestored", () => {
    scene = new Scene(canvas, over, film);
    resize();
  });
} catch (problem) {
  find("view").hidden = find("over").hidden = find("views").hidden = find("saves").hidden = true;
  find("no-view").hidden = false;
  // Only the 3D view has failed; everything else works without it.
  find("why").textContent = problem.message;
}
const plots = [0, 1].map((axis) => new Plot(find("plot-" + "xy"[axis]), film, axis, (time) => { pause(); seek(time); }));

function seek(time) {
  state.time = clamp(time, film.start, film.end);
  state.stale = true;
}

// Goes on by a number of ticks, or back if it is negative.
function step(ticks) {
  pause();
  const [i, share] = film.index(state.time);
  seek(film.time(clamp(ticks < 0 && share > 0 ? i + 1 + ticks : i + ticks, 0, film.count - 1)));
  link();
}

function play() {
  if (state.time >= film.end - 1e-9) seek(film.start);
  state.playing = true;
  state.last = performance.now();
  state.stale = true;
}

function pause() {
  const played = state.playing;
  state.playing = false;
  state.stale = true;
  if (played) link();
}

// Puts the time into the address, for a reload, and returns the link.
function link() {
  const hash = "#t=" + Number(state.time.toFixed(4));
  try {
    if (location.hash !== hash) history.replaceState(null, "", hash);
  } catch {
    // Some browsers allow no change of the address of a file.
  }
  return location.href.replace(/#.*$/, "") + hash;
}

function followLink() {
  const asked = new URLSearchParams(location.hash.slice(1)), time = /^(\d+\.?\d*|\.\d+)s?$/.exec(asked.get("t"));
  if (time) {
    state.playing = false;
    seek(Number(time[1]));
  }
  if (speeds.includes(Number(asked.get("speed")))) setSpeed(Number(asked.get("speed")));
  if (camera && VIEWS[asked.get("view")]) camera.set(asked.get("view"));
  save(asked.get("save"), false);
}

// Controls.
const speeds = [...find("speed").options].map((option) => Number(option.value));
function setSpeed(speed) {
  state.speed = speed;
  find("speed").value = String(speed);
}
// Goes to a slower or a faster speed, by a number of choices.
function changeSpeed(by) {
  setSpeed(speeds[clamp(speeds.indexOf(state.speed) + by, 0, speeds.length - 1)]);
}
setSpeed(1);
find("speed").addEventListener("change", (event) => {
  state.speed = Number(event.target.value);
  release();
});
const scrubber = find("time");
Object.assign(scrubber, { min: 0, max: film.count - 1, step: 1, value: 0 });
scrubber.addEventListener("input", () => {
  pause();
  seek(film.time(Number(scrubber.value)));
});
scrubber.addEventListener("change", link);
for (const plot of plots) plot.canvas.addEventListener("pointerup", link);

function toggle(id) {
  if (!shown.delete(id)) shown.add(id);
  find("show-" + id).setAttribute("aria-pressed", String(shown.has(id)));
  renderPlots();
}
for (const { id, key, name, color, hint } of toggles) {
  const chip = document.createElement("button");
  Object.assign(chip, { id: "show-" + id, className: "chip", type: "button", title: hint + " (" + key + ")" });
  const dot = document.createElement("i");
  dot.style.background = color;
  chip.append(dot, name);
  chip.setAttribute("aria-pressed", "true");
  chip.addEventListener("click", () => toggle(id));
  find("overlays").append(chip);
}

// Number of moments in 0.1 s, at least one.
const TENTH = Math.max(1, Math.round(0.1 / film.period));
const ACTIONS = {
  play: () => (state.playing ? pause() : play()),
  back: () => step(-1),
  forth: () => step(1),
  rewind: () => step(-TENTH),
  skip: () => step(TENTH),
  start: () => step(-film.count),
  end: () => step(film.count),
  slower: () => changeSpeed(-1),
  faster: () => changeSpeed(1),
  help: () => {
    const keys = find("keys");
    keys.open = !keys.open;
    if (keys.open) keys.scrollIntoView({ block: "nearest" });
  },
  link: () => copy(link()),
  command: () => copy(find("command-text").textContent),
};
find("save-webm").hidden = !SAVES.webm;
for (const kind of Object.keys(SAVES)) ACTIONS["save-" + kind] = () => save(kind, true);
for (const view of Object.keys(VIEWS)) ACTIONS["view-" + view] = () => camera && camera.set(view);
const KEYS = {
  " ": "play", ",": "back", ".": "forth", ArrowLeft: "rewind", ArrowRight: "skip", Home: "start", End: "end", r: "start",
  "-": "slower", "+": "faster", "=": "faster", h: "help", "?": "help", l: "link",
  v: "view-home", 1: "view-home", 2: "view-front", 3: "view-side", 4: "view-top",
};
document.addEventListener("click", (event) => {
  const button = event.target.closest("[data-do]");
  if (button) ACTIONS[button.dataset.do]();
  release();
});
// After a click the keys control the time, and not the button. A button that was reached by keys keeps the focus.
function release() {
  if (!document.activeElement.matches(":focus-visible")) document.activeElement.blur();
}
// Actions that a held key repeats.
const GO_ON = ["back", "forth", "rewind", "skip", "slower", "faster"];
document.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  const at = event.target;
  // An element that uses the key itself keeps it.
  if (at.closest("select") || (event.key === " " && at.closest("button, summary, a"))) return;
  const overlay = toggles.find(({ key }) => key === event.key);
  const action = KEYS[event.key];
  if (!overlay && !action) return;
  event.preventDefault();
  if (event.repeat && !GO_ON.includes(action)) return;
  if (overlay) toggle(overlay.id);
  else ACTIONS[action]();
});

let fading;
// Shows a text for a while.
function say(text) {
  find("toast").textContent = text;
  find("toast").hidden = false;
  clearTimeout(fading);
  fading = setTimeout(() => { find("toast").hidden = true; }, 5000);
}

function copy(text) {
  // Where copying is not allowed, the text stays on the page to be copied by hand.
  say(text);
  const clipboard = navigator.clipboard ? navigator.clipboard.writeText(text) : Promise.reject();
  clipboard.then(() => say("copied: " + text), () => {});
}

// The time line shows the phases of the controller and the events of the episode.
function strip() {
  const share = (time) => (100 * (clamp(time, film.start, film.end) - film.start)) / Math.max(film.end - film.start, 1e-9);
  const part = (parent, kind, from, to, title) => {
    const made = document.createElement("i");
    made.className = kind;
    made.title = title;
    made.style.left = share(from) + "%";
    if (to > from) made.style.width = share(to) - share(from) + "%";
    parent.append(made);
    return made;
  };
  const doing = (i) => {
    const gain = film.gain(i), { id, doing } = film.data.phases[film.phase(i)];
    return gain === null || id !== "switching" ? doing : "gain " + film.gains[gain];
  };
  for (let from = 0; from < film.count; ) {
    let to = from + 1;
    while (to < film.count && doing(to) === doing(from)) to++;
    const phase = film.data.phases[film.phase(from)].id, gain = film.gain(from);
    const made = part(find("phases"), phase, film.time(from), film.time(to), doing(from));
    // A faster gain has a stronger colour.
    if (phase === "switching" && gain !== null) made.style.opacity = 0.35 + (0.65 * (gain + 1)) / film.gains.length;
    from = to;
  }
  for (const { kind, from_s: from, to_s: to, text } of film.events) {
    part(find("marks"), kind, from, to, `${text}, ${from.toFixed(3)} s` + (to > from ? ` to ${to.toFixed(3)} s` : ""));
  }
}

function readouts(moment) {
  const mm = (metres) => (1000 * Math.abs(metres)).toFixed(0) + " mm ";
  const outside = moment.dcmOutside;
  const told = {
    clock: moment.time.toFixed(3) + " s",
    phase: moment.phase.doing,
    gain: moment.gain === null ? moment.phase.without_gain : film.gains[moment.gain],
    margin: moment.margin === null ? "none" : moment.margin.toFixed(2).replace("-", "\u2212"),
    edge: outside === null ? "no support" : mm(outside) + (outside > 0 ? "outside the support" : "inside the support"),
  };
  for (const [id, text] of Object.entries(told)) if (find(id).textContent !== text) find(id).textContent = text;
  find("doing").className = moment.phase.id;
  find("edge").className = outside === null || outside > 0 ? "bad" : "";
  find("margin").className = moment.margin < 0 ? "bad" : "";
}

function renderPlots() {
  for (const plot of plots) plot.render(theme(), shown);
  state.stale = true;
}

// Fits the canvases to the layout.
function resize() {
  if (state.saving) return;
  const ratio = window.devicePixelRatio || 1, pixels = (px) => Math.max(1, Math.round(px * ratio));
  if (scene) scene.over.ratio = ratio;
  for (const canvas of scene ? [find("view"), find("over")] : []) {
    [canvas.width, canvas.height] = [pixels(canvas.clientWidth), pixels(canvas.clientHeight)];
  }
  renderPlots();
}

function draw() {
  const moment = film.at(state.time);
  if (scene) scene.draw(moment, camera, theme(), shown);
  for (const plot of plots) plot.draw(moment);
  readouts(moment);
  scrubber.value = String(Math.round(film.index(state.time)[0]));
  scrubber.setAttribute("aria-valuetext", moment.time.toFixed(3) + " seconds");
  const button = find("play");
  button.setAttribute("aria-label", state.playing ? "pause" : "play");
  button.classList.toggle("playing", state.playing);
}

function frame(now) {
  if (state.playing) {
    // After a long time in the background, the film goes on where it was. The time of the first frame may lie before the start.
    seek(state.time + (state.speed * clamp(now - state.last, 0, 250)) / 1000);
    state.last = now;
    if (state.time >= film.end) pause();
  }
  if (state.stale && !state.saving) {
    state.stale = false;
    draw();
  }
  requestAnimationFrame(frame);
}

strip();
new ResizeObserver(resize).observe(find("stage"));
dark.addEventListener("change", renderPlots);
addEventListener("hashchange", followLink);
resize();
// The page opens at the first push, unless its address names another time.
const blow = film.events.find(({ kind }) => kind === "push");
if (blow) seek(blow.from_s);
followLink();
requestAnimationFrame(frame);
// For use in the console of the browser.
window.replay = { film, state, draw, seek, play, pause, camera, scene };
