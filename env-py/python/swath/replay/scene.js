// The picture of one pasture: ground, strip, path, weeds, mower and what it sees, with axes in metres.

const GLYPH_PX = 4;

// A round number of 1, 2 or 5 with zeros, such that `span` holds about `wanted` of it.
function roundStep(span, wanted) {
  const raw = span / wanted;
  const power = 10 ** Math.floor(Math.log10(raw));
  return power * [1, 2, 5, 10].find((factor) => factor * power >= raw * 0.999);
}

function ticksOf(low, high, wanted) {
  const step = roundStep(high - low, wanted);
  const ticks = [];
  for (let i = Math.ceil(low / step - 1e-9); i * step <= high + 1e-9 * step; i += 1) ticks.push(Number((i * step).toFixed(6)));
  return ticks;
}

// The colours of the page, light or dark.
function coloursOf(element) {
  const style = getComputedStyle(element);
  const names = ["ink", "muted", "paper", "outside", "unseen", "seen", "strip", "path", "undetected", "detected", "mowed", "mower", "sight", "fence"];
  return Object.fromEntries(names.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
}

// Gives a canvas as many pixels as the screen has where it stands, and returns its context in CSS pixels.
function fitted(canvas, widthPx, heightPx) {
  const ratio = window.devicePixelRatio || 1;
  const [width, height] = [Math.round(widthPx * ratio), Math.round(heightPx * ratio)];
  if (canvas.width !== width || canvas.height !== height) {
    canvas.width = width;
    canvas.height = height;
    canvas.style.height = `${heightPx}px`;
  }
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  return context;
}

// What stands for a weed: each state has a colour and a shape of its own.
const glyphs = {
  undetected(context, x, y, size, colours) {
    context.beginPath();
    context.arc(x, y, 0.62 * size, 0, 2 * Math.PI);
    context.strokeStyle = colours.undetected;
    context.lineWidth = 1.2;
    context.stroke();
  },
  detected(context, x, y, size, colours) {
    context.beginPath();
    context.moveTo(x, y - 1.3 * size);
    context.lineTo(x + 1.1 * size, y);
    context.lineTo(x, y + 1.3 * size);
    context.lineTo(x - 1.1 * size, y);
    context.closePath();
    context.fillStyle = colours.detected;
    context.fill();
    context.strokeStyle = colours.paper;
    context.lineWidth = 0.8;
    context.stroke();
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

class Scene {
  constructor(canvas, data, episode) {
    Object.assign(this, { canvas, data, episode });
    this.ground = document.createElement("canvas");
    this.ground.width = data.columns;
    this.ground.height = data.rows;
  }

  // Draws what there is after so many metres; `bounds` is what is shown, in metres.
  draw(pathM, bounds, colours) {
    const { data, episode, canvas } = this;
    const width = canvas.clientWidth;
    if (!width) return;
    const margin = { left: 44, right: 10, top: 8, bottom: 38 };
    const scale = (width - margin.left - margin.right) / (bounds.right - bounds.left);
    const height = Math.round(scale * (bounds.top - bounds.bottom) + margin.top + margin.bottom);
    const context = fitted(canvas, width, height);
    const x = (metres) => margin.left + scale * (metres - bounds.left);
    const y = (metres) => margin.top + scale * (bounds.top - metres);
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
    const pose = episode.poseAt(pathM);
    this.drawSight(context, pose, scale, colours);
    episode.trace(context, pathM);
    context.lineWidth = data.deck_width_m;
    context.strokeStyle = colours.strip;
    context.stroke();
    context.lineWidth = 1.2 / scale;
    context.strokeStyle = colours.path;
    context.stroke();
    context.restore();
    this.drawWeeds(context, pathM, x, y, colours);
    this.drawMower(context, pose, x, y, scale, colours);
    context.restore();
    drawAxes(context, bounds, x, y, colours);
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

  drawSight(context, pose, scale, colours) {
    const { range_m: range, sensor_width_m: sight, length_m: length, width_m: width } = this.data;
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
    context.strokeStyle = colours.sight;
    context.lineWidth = 1.5 / scale;
    context.stroke();
    context.strokeStyle = colours.fence;
    context.strokeRect(0, 0, length, width);
  }

  drawWeeds(context, pathM, x, y, colours) {
    const { episode } = this;
    const weeds = this.data.weeds;
    const size = weeds.length > 400 ? 0.7 * GLYPH_PX : GLYPH_PX;
    for (let weed = 0; 2 * weed < weeds.length; weed += 1) {
      const state = episode.isWeedMowed(weed, pathM) ? "mowed" : episode.isWeedDetected(weed, pathM) ? "detected" : "undetected";
      glyphs[state](context, x(weeds[2 * weed]), y(weeds[2 * weed + 1]), size, colours);
    }
  }

  drawMower(context, pose, x, y, scale, colours) {
    context.save();
    context.translate(x(pose.x), y(pose.y));
    context.rotate(-pose.heading);
    drawMowerShape(context, Math.max(0.5 * this.data.deck_width_m * scale, 5), colours);
    context.restore();
  }
}

// The mower, heading right: an arrow, and the deck as a bar across it.
function drawMowerShape(context, half, colours) {
  context.fillStyle = colours.mower;
  context.strokeStyle = colours.paper;
  context.lineWidth = 1;
  context.beginPath();
  context.moveTo(1.5 * half, 0);
  context.lineTo(-0.6 * half, 0.65 * half);
  context.lineTo(-0.6 * half, -0.65 * half);
  context.closePath();
  context.fill();
  context.stroke();
  context.fillRect(-1.5, -half, 3, 2 * half);
}

const FONT = "11px system-ui, sans-serif";

function drawAxes(context, bounds, x, y, colours) {
  const [left, right, top, bottom] = [x(bounds.left), x(bounds.right), y(bounds.top), y(bounds.bottom)];
  context.strokeStyle = colours.muted;
  context.fillStyle = colours.ink;
  context.lineWidth = 1;
  context.font = FONT;
  context.strokeRect(left, top, right - left, bottom - top);
  context.textAlign = "center";
  context.textBaseline = "top";
  for (const metres of ticksOf(bounds.left, bounds.right, Math.min(10, (right - left) / 55))) {
    context.beginPath();
    context.moveTo(x(metres), bottom);
    context.lineTo(x(metres), bottom + 4);
    context.stroke();
    context.fillText(String(metres), x(metres), bottom + 6);
  }
  context.fillText("x in m", 0.5 * (left + right), bottom + 21);
  context.textAlign = "right";
  context.textBaseline = "middle";
  for (const metres of ticksOf(bounds.bottom, bounds.top, Math.max(2, Math.min(6, (bottom - top) / 30)))) {
    context.beginPath();
    context.moveTo(left, y(metres));
    context.lineTo(left - 4, y(metres));
    context.stroke();
    context.fillText(String(metres), left - 6, y(metres));
  }
  context.save();
  context.translate(9, 0.5 * (top + bottom));
  context.rotate(-Math.PI / 2);
  context.textAlign = "center";
  context.fillText("y in m", 0, 0);
  context.restore();
}

// In the corner below the picture, where no weed is covered.
function drawScaleBar(context, bounds, x, y, scale, colours) {
  const metres = roundStep(bounds.right - bounds.left, 8);
  const [right, at] = [x(bounds.right), y(bounds.bottom) + 31];
  context.fillStyle = colours.ink;
  context.fillRect(right - scale * metres, at, scale * metres, 3);
  context.font = FONT;
  context.textAlign = "right";
  context.textBaseline = "middle";
  context.fillText(`${metres} m`, right - scale * metres - 5, at + 1);
}
