"use strict";
(() => {
  document.documentElement.classList.add("scripted");
  const data = JSON.parse(document.getElementById("trials").textContent);
  const tip = document.getElementById("tip"), toast = document.getElementById("toast");
  const all = (selector, root = document) => [...root.querySelectorAll(selector)];

  // Tooltips of pictures, which also work by touch.
  for (const title of all("svg title")) {
    title.parentNode.dataset.tip = title.textContent;
    title.remove();
  }
  function show(text, event) {
    tip.hidden = !text;
    if (!text) return;
    tip.textContent = text;
    const { width, height } = tip.getBoundingClientRect();
    const left = Math.min(event.clientX + 14, innerWidth - width - 8);
    const below = event.clientY + 18 + height < innerHeight;
    tip.style.left = Math.max(8, left) + "px";
    tip.style.top = (below ? event.clientY + 18 : event.clientY - height - 12) + "px";
  }

  // Copies a text. Where this is not allowed, the text stays on the page to be copied by hand.
  let fading;
  function copy(text) {
    const say = (word) => {
      toast.textContent = word + text;
      toast.hidden = false;
      clearTimeout(fading);
      fading = setTimeout(() => { toast.hidden = true; }, 6000);
    };
    say("");
    const clipboard = navigator.clipboard ? navigator.clipboard.writeText(text) : Promise.reject();
    clipboard.then(() => say("copied: "), () => {});
  }

  // Maps show the trial nearest to the pointer.
  const RADIUS = 130, NEAR = 9, OUTCOMES = { R: "recovered", S: "survived", F: "fell", B: "broke", D: "diverged", E: "failed", T: "timed out", "-": "not run" };
  const place = (trial, most) => {
    const heading = trial[2] * Math.PI / 180, length = RADIUS * trial[1] / most;
    return [-length * Math.sin(heading), -length * Math.cos(heading)];
  };
  const setsOf = (map) => map.dataset.sets.split(" ").map(Number);
  const isRun = (trial, set) => trial[3][set] !== "-";
  const isWon = (trial, set) => "RS".includes(trial[3][set]);
  const differs = (trial, sets) =>
    sets.every((set) => isRun(trial, set)) && isWon(trial, sets[0]) !== isWon(trial, sets[1]);
  function nearest(map, event) {
    if (!data) return null;
    const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(map.getScreenCTM().inverse());
    const sets = setsOf(map);
    let best = null, least = NEAR;
    for (const trial of data.trials.filter((trial) => sets.every((set) => isRun(trial, set)))) {
      const [x, y] = place(trial, map.dataset.most);
      // On a map of two sets, trials in which they differ have priority.
      const extra = sets.length > 1 && !differs(trial, sets) ? 3 : 0;
      const distance = Math.hypot(x - at.x, y - at.y) + extra;
      if (distance < least) [best, least] = [trial, distance];
    }
    return best;
  }
  function told(trial) {
    const lines = data.sets.map((name, i) => {
      const steps = trial[4][i], word = steps === 1 ? "footstep" : "footsteps";
      return name + ": " + OUTCOMES[trial[3][i]] + (steps ? ", " + steps + " " + word : "");
    });
    const push = trial[1].toFixed(2) + " N s at " + trial[2].toFixed(0).replace("-", "\u2212") + "\u00b0";
    return ["trial " + trial[0] + ": " + push, ...lines].join("\n");
  }
  function mark(trial) {
    all(".here").forEach((ring) => ring.remove());
    if (!trial) return;
    for (const map of all(".map")) {
      const ring = document.createElementNS("http://www.w3.org/2000/svg", "circle");
      const [x, y] = place(trial, map.dataset.most);
      Object.entries({ class: "here", cx: x, cy: y, r: 5.5 }).forEach(([k, v]) => ring.setAttribute(k, v));
      map.append(ring);
    }
  }
  let marked = null, pinned = null;
  document.addEventListener("pointermove", (event) => {
    const map = event.target.closest(".map");
    const trial = map && nearest(map, event);
    if (trial !== marked) mark((marked = trial) ?? pinned);
    if (map) map.style.cursor = trial ? "copy" : "";
    const part = event.target.closest("[data-tip]");
    show(trial ? told(trial) : part ? part.dataset.tip : "", event);
  });
  document.addEventListener("scroll", () => show(""), { passive: true });
  document.addEventListener("click", (event) => {
    const command = event.target.closest(".command");
    if (command) return copy(command.dataset.copy ?? command.textContent);
    // A link to a folded part unfolds it.
    const link = event.target.closest("a[href^='#']");
    if (link) document.getElementById(link.hash.slice(1))?.closest("details")?.setAttribute("open", "");
    // The trial of a clicked number stays marked on the maps until the next click.
    const number = event.target.closest("[data-trial]");
    pinned = number && data.trials.find((trial) => trial[0] === Number(number.dataset.trial));
    if (number || !marked) mark(pinned);
    const map = event.target.closest(".map");
    const trial = map && nearest(map, event);
    if (!trial) return;
    // On a map of two sets, the command replays the trial with the set that lost it.
    const sets = setsOf(map);
    const set = sets.find((i) => !isWon(trial, i)) ?? sets[0];
    copy(data.commands[set].join(trial[0]));
  });

  // The navigation marks the section on the screen, and scrolls to its name on a narrow screen.
  const nav = document.querySelector("nav"), links = all("a", nav);
  const reading = new IntersectionObserver((sections) => {
    const found = sections.find((section) => section.isIntersecting);
    if (!found) return;
    for (const link of links) {
      link.toggleAttribute("aria-current", link.hash === "#" + found.target.id);
      if (link.hasAttribute("aria-current")) nav.scrollTo({ left: link.offsetLeft - 24 });
    }
  }, { rootMargin: "-20% 0px -75%" });
  all("section").forEach((section) => reading.observe(section));

  // Choosers of pairs all show the same pair. The name of a set hides its curve.
  const choosers = all(".choose-pair");
  function choose(pair) {
    choosers.forEach((chooser) => { chooser.value = pair; });
    all("[data-pair]").forEach((part) => { part.hidden = pair !== "all" && part.dataset.pair !== pair; });
  }
  choosers.forEach((chooser) => chooser.addEventListener("change", () => choose(chooser.value)));
  if (choosers.length) choose(all("[data-pair]").length > 3 * choosers.length ? choosers[0].value : "all");
  for (const chip of all("[data-toggle]")) {
    chip.addEventListener("click", () => {
      const off = chip.getAttribute("aria-pressed") === "true";
      chip.setAttribute("aria-pressed", String(!off));
      all(".curve [data-set='" + chip.dataset.toggle + "']").forEach((curve) => {
        curve.toggleAttribute("hidden", off);
      });
    });
  }
})();
