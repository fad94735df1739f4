// The player: one clock for all agents, in metres driven, since all of them drive at one speed.

const PLAYS_FOR_S = 30;
const SPEEDS_MPS = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000];
const OUTCOMES = { done: "done", capped: "stopped by its safety cap", left_headland: "left the headland (failed)" };

function element(name, attributes = {}, children = []) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (key === "text") made.textContent = value;
    else made.setAttribute(key, value);
  }
  made.append(...children);
  return made;
}

// Pictures stand beside each other where each has so much room, or is not much smaller than above each other.
const BESIDE_PX = 250;
const BESIDE_SHARE = 0.5;
const GAP_PX = 12;
const LEAST_PLOT_PX = 48;
const COMPACT_PX = { panel: 400, width: 760, height: 520 };

class Player {
  // Builds the player into `root`; keys are heard on `keys`. In the same window shall be what stands above it: on a page
  // of its own all, else what its parent element has.
  constructor(root, data, keys) {
    this.root = root;
    this.isPage = keys === document;
    this.data = { ...data, weeds: numbersOf(data.weeds_m, Float32Array) };
    this.episodes = data.agents.map((agent) => new Episode(agent));
    this.longestM = Math.max(...this.episodes.map((episode) => episode.lengthM));
    this.bounds = boundsOf(this.data);
    this.pathM = 0;
    this.isPlaying = false;
    this.lastMs = null;
    this.build();
    keys.addEventListener("keydown", (event) => this.onKey(event));
    new ResizeObserver(() => requestAnimationFrame(() => this.fit())).observe(root);
    window.addEventListener("resize", () => this.fit());
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.recolour());
    this.recolour();
    this.fit();
  }

  build() {
    this.panels = this.episodes.map((episode) => this.panelOf(episode));
    this.race = new Race(element("canvas", { class: "race", role: "img" }), this.episodes);
    this.row = element("div", { class: "panels" }, this.panels.map((panel) => panel.box));
    this.below = [this.controls(), this.legend()];
    this.root.append(
      this.row,
      ...this.below,
      element("figure", { class: "curves" }, [
        element("figcaption", { text: "Weeds mowed over the path driven: faint what is to come" }),
        this.race.canvas,
      ]),
    );
  }

  panelOf(episode) {
    const canvas = element("canvas", { class: "scene", role: "img" });
    const status = element("p", { class: "status" });
    const swatch = element("canvas", { class: "swatch", width: 52, height: 20, "aria-hidden": "true" });
    const heading = element("h3", { title: episode.yardstick }, [swatch, "\u00a0", ...wordsOf(episode.title)]);
    const box = element("section", { class: "panel", "aria-label": episode.title }, [heading, canvas, status]);
    return { box, canvas, status, swatch, episode, scene: new Scene(canvas, this.data, episode) };
  }

  // Makes pictures, controls and legend fit into the window: the pictures beside each other, all in one scale.
  fit() {
    const [width, height] = [this.root.clientWidth, window.innerHeight];
    if (!width) return;
    const isSmall = width < COMPACT_PX.width || height < COMPACT_PX.height;
    this.root.classList.toggle("small", isSmall);
    const above = this.root.offsetTop - (this.isPage ? 0 : this.root.parentElement.offsetTop);
    const last = this.below.at(-1);
    const below = last.offsetTop + last.offsetHeight - this.row.offsetTop - this.row.offsetHeight;
    const room = height - above - below - GAP_PX;
    const count = this.panels.length;
    // No more in a row than have room at their least width; of those that show most, the most.
    const most = Math.max(1, Math.min(count, Math.floor((width + GAP_PX) / (LEAST_WIDTH_PX + GAP_PX))));
    const scales = Array.from({ length: most }, (_, fewer) => this.scaleOf(fewer + 1, width, room));
    const best = Math.max(...scales);
    const isBeside = most === count && (this.arrange(count, width) >= BESIDE_PX || scales[count - 1] >= BESIDE_SHARE * best);
    const columns = isBeside ? count : scales.findLastIndex((scale) => scale >= best - 1e-6) + 1;
    this.arrange(columns, width);
    for (const { scene } of this.panels) scene.fit(scales[columns - 1], this.bounds);
    this.draw();
  }

  // Pixels to a metre where so many panels stand in a row.
  scaleOf(columns, width, room) {
    const [length, across] = [this.bounds.right - this.bounds.left, this.bounds.top - this.bounds.bottom];
    const cell = this.arrange(columns, width) - MARGIN.left - MARGIN.right;
    const words = Math.max(...this.panels.map(({ box, canvas }) => box.offsetHeight - canvas.offsetHeight));
    const rows = Math.ceil(this.panels.length / columns);
    const tall = (room - GAP_PX * (rows - 1)) / rows - words - MARGIN.top - MARGIN.bottom;
    return Math.min(cell / length, Math.max(tall, LEAST_PLOT_PX) / across);
  }

  // Puts so many panels into a row, and returns how wide each may be.
  arrange(columns, width) {
    const cell = (width - GAP_PX * (columns - 1)) / columns;
    this.row.style.gridTemplateColumns = `repeat(${columns}, minmax(0, 1fr))`;
    this.isCompact = cell < COMPACT_PX.panel;
    for (const panel of this.panels) this.tell(panel);
    return cell;
  }

  // Writes how an episode stands below its picture.
  tell({ episode, canvas, status }) {
    const words = statusOf(episode, this.pathM);
    status.replaceChildren(...(this.isCompact ? shortStatusOf(episode, this.pathM) : words).map((text) => element("span", { text })));
    canvas.setAttribute("aria-label", `${episode.title}: ${words.join(", ")}`);
  }

  controls() {
    this.button = element("button", { type: "button", class: "play" });
    this.button.addEventListener("click", () => this.toggle());
    this.slider = element("input", {
      type: "range", class: "scrub", min: 0, max: this.longestM, step: "any", value: 0, "aria-label": "Path driven, metres",
    });
    this.slider.addEventListener("input", () => this.goTo(Number(this.slider.value)));
    const wanted = this.longestM / PLAYS_FOR_S;
    const nearest = SPEEDS_MPS.reduce((best, speed) => (Math.abs(Math.log(speed / wanted)) < Math.abs(Math.log(best / wanted)) ? speed : best));
    this.speed = element("select", { class: "speed", "aria-label": "Speed" }, SPEEDS_MPS.map((speed) => {
      const option = element("option", { value: speed, text: `${speed} m/s` });
      option.selected = speed === nearest;
      return option;
    }));
    this.readout = element("output", { class: "readout" });
    return element("div", { class: "controls" }, [
      this.button, this.slider, this.readout, element("label", {}, [element("span", { class: "more", text: "Speed " }), this.speed]),
    ]);
  }

  legend() {
    const entries = [
      ["weed, undetected", (context, colours) => glyphs.undetected(context, 13, 8, GLYPH_PX, colours)],
      ["weed, detected", (context, colours) => glyphs.detected(context, 13, 8, GLYPH_PX, colours)],
      ["weed, mowed", (context, colours) => glyphs.mowed(context, 13, 8, GLYPH_PX, colours)],
      ["mower, deck", (context, colours) => {
        context.translate(9, 8);
        drawMowerShape(context, 7, colours);
      }],
      ["sensor", (context, colours) => {
        context.beginPath();
        context.moveTo(3, 8);
        context.lineTo(23, 1);
        context.lineTo(23, 15);
        context.closePath();
        context.fillStyle = colours.sight;
        context.fill();
        context.strokeStyle = colours["sight-edge"];
        context.lineWidth = 1;
        context.stroke();
      }],
      ["start", (context, colours) => drawStart(context, 13, 8, colours)],
      ["path, mowed strip", (context, colours) => {
        context.fillStyle = colours.seen;
        context.fillRect(0, 0, 26, 16);
        context.fillStyle = colours.strip;
        context.fillRect(0, 3, 26, 10);
        context.fillStyle = colours.path;
        context.fillRect(0, 7, 26, 1.5);
      }],
      ["ground seen", (context, colours) => {
        context.fillStyle = colours.seen;
        context.fillRect(0, 0, 26, 16);
      }],
      ["ground not seen", (context, colours) => {
        context.fillStyle = colours.unseen;
        context.fillRect(0, 0, 26, 16);
      }],
    ];
    this.swatches = [];
    const items = entries.map(([text, draw]) => {
      const canvas = element("canvas", { width: 52, height: 32, "aria-hidden": "true" });
      this.swatches.push({ canvas, draw });
      return element("li", {}, [canvas, text]);
    });
    return element("ul", { class: "legend", "aria-label": "Legend" }, items);
  }

  recolour() {
    for (const panel of this.panels) {
      panel.colours = coloursOf(panel.episode, this.root);
      drawSwatch(panel.swatch, panel.colours.path, panel.episode.dash);
    }
    this.colours = this.panels[0].colours;
    for (const { canvas, draw } of this.swatches) {
      const context = canvas.getContext("2d");
      context.setTransform(2, 0, 0, 2, 0, 0);
      context.globalAlpha = 1;
      context.clearRect(0, 0, 26, 16);
      draw(context, this.colours);
    }
    this.draw();
  }

  toggle() {
    if (!this.isPlaying && this.pathM >= this.longestM) this.pathM = 0;
    this.isPlaying = !this.isPlaying;
    this.lastMs = null;
    if (this.isPlaying) requestAnimationFrame((nowMs) => this.tick(nowMs));
    this.draw();
  }

  tick(nowMs) {
    if (!this.isPlaying) return;
    if (this.lastMs !== null) this.pathM += ((nowMs - this.lastMs) / 1000) * Number(this.speed.value);
    this.lastMs = nowMs;
    if (this.pathM >= this.longestM) {
      this.pathM = this.longestM;
      this.isPlaying = false;
    } else {
      requestAnimationFrame((next) => this.tick(next));
    }
    this.draw();
  }

  goTo(pathM) {
    this.pathM = Math.max(0, Math.min(pathM, this.longestM));
    this.draw();
  }

  onKey(event) {
    const isTyped = event.target instanceof HTMLSelectElement || event.ctrlKey || event.metaKey || event.altKey;
    if (isTyped || (event.key === " " && event.target === this.button)) return;
    const stepM = (event.shiftKey ? 0.1 : 0.01) * this.longestM;
    const actions = {
      " ": () => this.toggle(),
      ArrowRight: () => this.goTo(this.pathM + stepM),
      ArrowLeft: () => this.goTo(this.pathM - stepM),
      ArrowUp: () => this.changeSpeed(1),
      ArrowDown: () => this.changeSpeed(-1),
      Home: () => this.goTo(0),
      End: () => this.goTo(this.longestM),
    };
    if (!(event.key in actions)) return;
    event.preventDefault();
    actions[event.key]();
  }

  changeSpeed(by) {
    this.speed.selectedIndex = Math.max(0, Math.min(this.speed.selectedIndex + by, SPEEDS_MPS.length - 1));
  }

  draw() {
    if (!this.colours) return;
    for (const panel of this.panels) {
      panel.scene.draw(this.pathM, panel.colours);
      this.tell(panel);
    }
    this.race.draw(this.pathM, this.colours);
    this.race.canvas.setAttribute("aria-label", `Weeds mowed over the path driven, up to ${this.pathM.toFixed(0)} m`);
    const text = `${this.pathM.toFixed(1)} of ${this.longestM.toFixed(1)} m`;
    const seconds = Math.round(this.pathM / this.data.speed_mps);
    const time = ` · ${Math.floor(seconds / 60)} min ${seconds % 60} s at ${this.data.speed_mps} m/s`;
    this.readout.replaceChildren(text, element("span", { class: "more", text: time }));
    this.slider.value = this.pathM;
    this.slider.setAttribute("aria-valuetext", text);
    this.button.textContent = this.isPlaying ? "❚❚ Pause" : "▶ Play";
  }
}

// A title that may be broken where an option begins.
function wordsOf(title) {
  return title.split(/(?<=[:,])/).flatMap((words) => [words, element("wbr")]);
}

function drawSwatch(canvas, colour, dash) {
  const context = canvas.getContext("2d");
  context.setTransform(2, 0, 0, 2, 0, 0);
  context.clearRect(0, 0, 26, 10);
  context.strokeStyle = colour;
  context.lineWidth = 3;
  context.setLineDash(dash);
  context.beginPath();
  context.moveTo(0, 5);
  context.lineTo(26, 5);
  context.stroke();
}

// What is written below a picture.
function statusOf(episode, pathM) {
  const counts = episode.countsAt(pathM);
  return [
    `path ${counts.pathM.toFixed(1)} m (${percentOf(episode, counts)} % of the boustrophedon path)`,
    `weeds: ${counts.mowed} mowed, ${counts.detected} detected, ${counts.undetected} undetected`,
    `ground seen ${counts.seenPercent.toFixed(1)} %`,
    outcomeOf(episode, pathM),
  ];
}

// The same in fewer words.
function shortStatusOf(episode, pathM) {
  const counts = episode.countsAt(pathM);
  const all = counts.mowed + counts.detected + counts.undetected;
  return [
    `${counts.pathM.toFixed(1)} m (${percentOf(episode, counts)} %)`,
    `${counts.mowed} of ${all} mowed`,
    `${counts.seenPercent.toFixed(1)} % seen`,
    outcomeOf(episode, pathM),
  ];
}

function percentOf(episode, counts) {
  return ((100 * counts.pathM) / episode.boustrophedonM).toFixed(1);
}

function outcomeOf(episode, pathM) {
  return episode.isOver(pathM) ? OUTCOMES[episode.outcome] || episode.outcome : "driving";
}

// What every picture shows: the pasture and all paths, in metres.
function boundsOf(data) {
  const edge = 2;
  return {
    left: Math.min(data.left_m, 0) - edge,
    right: Math.max(data.right_m, data.length_m) + edge,
    bottom: Math.min(data.bottom_m, 0) - edge,
    top: Math.max(data.top_m, data.width_m) + edge,
  };
}
