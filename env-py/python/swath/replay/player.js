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

class Player {
  // Builds the player into `root`; keys are heard on `keys`.
  constructor(root, data, keys) {
    this.root = root;
    this.data = { ...data, weeds: numbersOf(data.weeds_m, Float32Array) };
    this.episodes = data.agents.map((agent) => new Episode(agent));
    this.longestM = Math.max(...this.episodes.map((episode) => episode.lengthM));
    this.bounds = boundsOf(this.data);
    this.pathM = 0;
    this.isPlaying = false;
    this.lastMs = null;
    this.build();
    keys.addEventListener("keydown", (event) => this.onKey(event));
    new ResizeObserver(() => this.draw()).observe(root);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.recolour());
    this.recolour();
  }

  build() {
    this.panels = this.episodes.map((episode, number) => this.panelOf(episode, number));
    this.race = new Race(element("canvas", { class: "race", role: "img" }), this.episodes, this.data.agents.map((agent) => agent.line));
    this.root.append(
      element("div", { class: "panels" }, this.panels.map((panel) => panel.box)),
      this.controls(),
      this.legend(),
      element("figure", { class: "curves" }, [
        element("figcaption", { text: "Weeds mowed over the path driven: faint what is to come" }),
        this.race.canvas,
      ]),
    );
  }

  panelOf(episode, number) {
    const canvas = element("canvas", { class: "scene", role: "img" });
    const status = element("p", { class: "status" });
    const swatch = element("canvas", { class: "swatch", width: 52, height: 20, "aria-hidden": "true" });
    const heading = element("h3", {}, [swatch, ` ${episode.label}`]);
    const box = element("section", { class: "panel", "aria-label": episode.label }, [heading, canvas, status]);
    return { box, canvas, status, swatch, episode, scene: new Scene(canvas, this.data, episode) };
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
    this.speed = element("select", { class: "speed" }, SPEEDS_MPS.map((speed) => {
      const option = element("option", { value: speed, text: `${speed} m/s` });
      option.selected = speed === nearest;
      return option;
    }));
    this.readout = element("output", { class: "readout" });
    return element("div", { class: "controls" }, [
      this.button, this.slider, this.readout, element("label", {}, ["Speed ", this.speed]),
    ]);
  }

  legend() {
    const entries = [
      ["weed, undetected", (context, colours) => glyphs.undetected(context, 13, 8, GLYPH_PX, colours)],
      ["weed, detected", (context, colours) => glyphs.detected(context, 13, 8, GLYPH_PX, colours)],
      ["weed, mowed", (context, colours) => glyphs.mowed(context, 13, 8, GLYPH_PX, colours)],
      ["mower, deck", (context, colours) => {
        context.translate(10, 8);
        drawMowerShape(context, 7, colours);
      }],
      ["sensor", (context, colours) => {
        context.beginPath();
        context.moveTo(3, 8);
        context.lineTo(23, 1);
        context.lineTo(23, 15);
        context.closePath();
        context.strokeStyle = colours.sight;
        context.lineWidth = 1.5;
        context.stroke();
        context.globalAlpha = 0.35;
        context.fillStyle = colours.sight;
        context.fill();
      }],
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
    this.colours = coloursOf(this.root);
    this.panels.forEach(({ swatch }, number) => drawSwatch(swatch, ...lineOf(this.data.agents[number].line, this.root)));
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
      panel.scene.draw(this.pathM, this.bounds, this.colours);
      const status = statusOf(panel.episode, this.pathM);
      panel.status.replaceChildren(...status.map((text) => element("span", { text })));
      panel.canvas.setAttribute("aria-label", `${panel.episode.label}: ${status.join(", ")}`);
    }
    this.race.draw(this.pathM, this.colours);
    this.race.canvas.setAttribute("aria-label", `Weeds mowed over the path driven, up to ${this.pathM.toFixed(0)} m`);
    const text = `${this.pathM.toFixed(0)} of ${this.longestM.toFixed(0)} m`;
    const seconds = Math.round(this.pathM / this.data.speed_mps);
    this.readout.textContent = `${text} · ${Math.floor(seconds / 60)} min ${seconds % 60} s at ${this.data.speed_mps} m/s`;
    this.slider.value = this.pathM;
    this.slider.setAttribute("aria-valuetext", text);
    this.button.textContent = this.isPlaying ? "❚❚ Pause" : "▶ Play";
  }
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
  const percent = (100 * counts.pathM) / episode.boustrophedonM;
  const parts = [
    `path ${counts.pathM.toFixed(0)} m (${percent.toFixed(0)} % of the boustrophedon path)`,
    `weeds: ${counts.mowed} mowed, ${counts.detected} detected, ${counts.undetected} undetected`,
    `ground seen ${counts.seenPercent.toFixed(0)} %`,
  ];
  parts.push(episode.isOver(pathM) ? OUTCOMES[episode.outcome] || episode.outcome : "driving");
  return parts;
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
