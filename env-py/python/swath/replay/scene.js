// The picture of one pasture: ground, strip, path, weeds, mower and what it sees, with axes in metres.

const GLYPH_PX = 4;

// A round number of 1, 2 or 5 with zeros, such that `span` holds about `wanted` of it.
function roundStep(span, wanted) {
  const raw = span / wanted;
  const power = 10 ** Math.floor(Math.log10(raw));
  return power * [1, 2, 5, 10].find((factor) => factor * power >= raw * 0.999);
}

// About as many round numbers between two others as are wanted, but two at least.
function ticksOf(low, high, wanted) {
  for (let count = Math.max(wanted, 1); ; count *= 2) {
    const step = roundStep(high - low, count);
    const ticks = [];
    for (let i = Math.ceil(low / step - 1e-9); i * step <= high + 1e-9 * step; i += 1) ticks.push(Number((i * step).toFixed(6)));
    if (ticks.length > 1) return ticks;
  }
}

// A colour of the page, light or dark.
function colourOf(name, element) {
  return getComputedStyle(element).getPropertyValue(name).trim();
}

const COLOURS = ["ink", "muted", "paper", "outside", "unseen", "seen", "strip", "undetected", "detected", "mowed", "sight", "sight-edge", "fence"];

// The colours of a picture: of the page, and that of its agent for the path.
function coloursOf(episode, element) {
  const found = Object.fromEntries(COLOURS.map((name) => [name, colourOf(`--${name}`, element)]));
  return { ...found, path: colourOf(episode.colour, element) };
}

// Gives a canvas as many pixels as the screen has where it stands, and returns its context in CSS pixels.
function fitted(canvas, widthPx, heightPx) {
  const ratio = window.devicePixelRatio || 1;
  const [width, height] = [Math.round(widthPx * ratio), Math.round(heightPx * ratio)];
  if (canvas.width !== width || canvas.height !== height) {
    canvas.width = width;
    canvas.height = height;
    Object.assign(canvas.style, { width: `${widthPx}px`, height: `${heightPx}px` });
  }
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  return context;
}

// What stands for a weed: each state has a colour and a shape of its own.
const glyphs = {
  undetected(context, x, y, size, colours) {
    context.beginPath();
    context.arc(x, y, 0.75 * size, 0, 2 * Math.PI);
    context.fillStyle = colours.paper;
    context.fill();
    context.strokeStyle = colours.undetected;
    context.lineWidth = 1.2;
    context.stroke();
  },
  detected(context, x, y, size, colours) {
    context.beginPath();
    context.moveTo(x, y - 1.15 * size);
    context.lineTo(x + 1.15 * size, y);
    context.lineTo(x, y + 1.15 * size);
    context.lineTo(x - 1.15 * size, y);
    context.closePath();
    context.strokeStyle = colours.ink;
    context.lineWidth = 1.6;
    context.stroke();
    context.fillStyle = colours.detected;
    context.fill();
  },
  mowed(context, x, y, size, colours) {
    context.beginPath();
    for (const side of [-1, 1]) {
      context.moveTo(x - 0.8 * size, y - 0.8 * side * size);
      context.lineTo(x + 0.8 * size, y + 0.8 * side * size);
    }
    context.strokeStyle = colours.mowed;
    context.lineWidth = 2;
    context.stroke();
  },
};

// What surrounds a plot, in pixels: labels of its axes, and the scale bar.
const MARGIN = { left: 46, right: 22, top: 6, bottom: 34 };
const LEAST_WIDTH_PX = 140;

class Scene {
  constructor(canvas, data, episode) {
    Object.assign(this, { canvas, data, episode, scale: 0 });
    this.ground = document.createElement("canvas");
    this.ground.width = data.columns;
    this.ground.height = data.rows;
  }

  // So many pixels to a metre; `bounds` is what is shown, in metres.
  fit(scale, bounds) {
    const plot = scale * (bounds.right - bounds.left) + MARGIN.left + MARGIN.right;
    Object.assign(this, { scale, bounds, width: Math.round(Math.max(plot, LEAST_WIDTH_PX)) });
    this.left = MARGIN.left + 0.5 * (this.width - plot);
    this.height = Math.round(scale * (bounds.top - bounds.bottom) + MARGIN.top + MARGIN.bottom);
    fitted(this.canvas, this.width, this.height);
  }

  // Draws what there is after so many metres.
  draw(pathM, colours) {
    const { data, episode, scale, bounds, width, height } = this;
    if (!scale) return;
    const context = fitted(this.canvas, width, height);
    const x = (metres) => this.left + scale * (metres - bounds.left);
    const y = (metres) => MARGIN.top + scale * (bounds.top - metres);
    context.fillStyle = colours.paper;
    context.fillRect(0, 0, width, height);

    context.save();
    context.beginPath();
    context.rect(x(bounds.left), y(bounds.top), x(bounds.right) - x(bounds.left), y(bounds.bottom) - y(bounds.top));
    context.clip();
    context.fillStyle = colours.outside;
    context.fillRect(0, 0, width, height);
    context.save();
    context.transform(scale, 0, 0, -scale, x(0), y(0));
    this.drawGround(context, pathM, colours);
    episode.trace(context, pathM);
    context.lineWidth = data.deck_width_m;
    context.strokeStyle = colours.strip;
    context.stroke();
    context.strokeStyle = colours.fence;
    context.lineWidth = 1.2 / scale;
    context.strokeRect(0, 0, data.length_m, data.width_m);
    episode.trace(context, pathM);
    context.lineWidth = 1.4 / scale;
    context.strokeStyle = colours.path;
    context.stroke();
    const pose = episode.poseAt(pathM);
    this.drawSight(context, pose, colours);
    context.restore();
    drawStart(context, x(episode.start.x), y(episode.start.y), colours);
    this.drawWeeds(context, pathM, x, y, colours);
    this.drawMower(context, pose, x, y, colours);
    context.restore();
    drawAxes(context, bounds, x, y, scale, colours);
    drawScaleBar(context, bounds, x, y, scale, colours);
  }

  drawGround(context, pathM, colours) {
    const { data, episode } = this;
    const step = episode.seenStepAt(pathM);
    const ground = this.ground.getContext("2d");
    ground.fillStyle = colours.unseen;
    ground.fillRect(0, 0, data.columns, data.rows);
    ground.fillStyle = colours.seen;
    for (let row = 0; row < data.rows; row += 1) {
      // Cells beside each other are filled together.
      let first = -1;
      for (let column = 0; column <= data.columns; column += 1) {
        const isSeen = column < data.columns && episode.seenStep[row * data.columns + column] <= step;
        if (isSeen && first < 0) first = column;
        if (!isSeen && first >= 0) {
          ground.fillRect(first, row, column - first, 1);
          first = -1;
        }
      }
    }
    context.imageSmoothingEnabled = false;
    context.drawImage(this.ground, 0, 0, data.length_m, data.width_m);
  }

  drawSight(context, pose, colours) {
    const { range_m: range, sensor_width_m: sight } = this.data;
    const [cos, sin] = [Math.cos(pose.heading), Math.sin(pose.heading)];
    context.beginPath();
    context.moveTo(pose.x, pose.y);
    for (const side of [-0.5, 0.5]) {
      context.lineTo(pose.x + range * cos - side * sight * sin, pose.y + range * sin + side * sight * cos);
    }
    context.closePath();
    context.globalAlpha = 0.35;
    context.fillStyle = colours.sight;
    context.fill();
    context.globalAlpha = 1;
    context.strokeStyle = colours["sight-edge"];
    context.lineWidth = 1 / this.scale;
    context.stroke();
  }

  // Those that matter most on top.
  drawWeeds(context, pathM, x, y, colours) {
    const { episode } = this;
    const weeds = this.data.weeds;
    const size = Math.min(GLYPH_PX, Math.max(2.6, 0.8 * this.scale)) * (weeds.length > 400 ? 0.7 : 1);
    for (const shown of ["mowed", "undetected", "detected"]) {
      for (let weed = 0; 2 * weed < weeds.length; weed += 1) {
        const state = episode.isWeedMowed(weed, pathM) ? "mowed" : episode.isWeedDetected(weed, pathM) ? "detected" : "undetected";
        if (state === shown) glyphs[state](context, x(weeds[2 * weed]), y(weeds[2 * weed + 1]), size, colours);
      }
    }
  }

  drawMower(context, pose, x, y, colours) {
    context.save();
    context.translate(x(pose.x), y(pose.y));
    context.rotate(-pose.heading);
    drawMowerShape(context, Math.max(0.5 * this.data.deck_width_m * this.scale, 4.5), colours);
    context.restore();
  }
}

// Where the path begins.
function drawStart(context, x, y, colours) {
  context.beginPath();
  context.arc(x, y, 3, 0, 2 * Math.PI);
  context.fillStyle = colours.paper;
  context.fill();
  context.strokeStyle = colours.path;
  context.lineWidth = 1.6;
  context.stroke();
}

// The mower, heading right: an arrow, and the deck as a bar across it.
function drawMowerShape(context, half, colours) {
  context.beginPath();
  context.moveTo(1.5 * half, 0);
  context.lineTo(0.8 * half, 0.6 * half);
  context.lineTo(0, 0.6 * half);
  context.lineTo(0, -0.6 * half);
  context.lineTo(0.8 * half, -0.6 * half);
  context.closePath();
  context.strokeStyle = colours.paper;
  context.lineWidth = 2;
  context.stroke();
  context.fillStyle = colours.path;
  context.fill();
  context.fillStyle = colours.paper;
  context.fillRect(-2.2, -half - 1, 4.4, 2 * half + 2);
  context.fillStyle = colours.ink;
  context.fillRect(-1.4, -half, 2.8, 2 * half);
}

const FONT = "11px system-ui, sans-serif";
const TICK_ROOM_PX = 52;

function drawAxes(context, bounds, x, y, scale, colours) {
  const [left, right, top, bottom] = [x(bounds.left), x(bounds.right), y(bounds.top), y(bounds.bottom)];
  context.strokeStyle = colours.muted;
  context.fillStyle = colours.ink;
  context.lineWidth = 1;
  context.font = FONT;
  context.strokeRect(left, top, right - left, bottom - top);
  const along = ticksOf(bounds.left, bounds.right, Math.min(10, (right - left) / TICK_ROOM_PX));
  const last = along.length - 1;
  // Where labels would touch, those of the ends stand outside their ticks.
  const isTight = scale * (along[1] - along[0]) < 36;
  context.textBaseline = "top";
  along.forEach((metres, number) => {
    context.beginPath();
    context.moveTo(x(metres), bottom);
    context.lineTo(x(metres), bottom + 4);
    context.stroke();
    if (isTight && number > 0 && number < last) return;
    context.textAlign = !isTight ? "center" : number === 0 ? "right" : "left";
    context.fillText(`${metres} m`, x(metres), bottom + 6);
  });
  context.textAlign = "right";
  context.textBaseline = "middle";
  const upward = ticksOf(bounds.bottom, bounds.top, Math.min(8, (bottom - top) / 26));
  const isFlat = scale * (upward[1] - upward[0]) < 12;
  upward.forEach((metres, number) => {
    context.beginPath();
    context.moveTo(left, y(metres));
    context.lineTo(left - 4, y(metres));
    context.stroke();
    const isEnd = number === 0 || number === upward.length - 1;
    const aside = !isFlat ? 0 : number === 0 ? 5 : -5;
    if (!isFlat || isEnd) context.fillText(`${metres} m`, left - 6, y(metres) + aside);
  });
}

// In the corner below the picture, where no weed is covered.
function drawScaleBar(context, bounds, x, y, scale, colours) {
  const metres = roundStep(30 / scale, 1);
  const [right, at] = [x(bounds.right), y(bounds.bottom) + 26];
  context.fillStyle = colours.ink;
  context.fillRect(right - scale * metres, at, scale * metres, 1.5);
  for (const end of [right - scale * metres, right - 1.5]) context.fillRect(end, at - 3, 1.5, 7.5);
  context.font = FONT;
  context.textAlign = "right";
  context.textBaseline = "middle";
  context.fillText(`${metres} m`, right - scale * metres - 5, at + 1);
}
