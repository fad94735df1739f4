// One agent's episode: where the mower is, and what it has found, after so many metres of path.

function numbersOf(text, Kind) {
  const bytes = Uint8Array.from(atob(text), (character) => character.charCodeAt(0));
  return new Kind(bytes.buffer);
}

// How many of some ascending numbers are at most `limit`.
function countUpTo(ascending, limit) {
  let low = 0;
  let high = ascending.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (ascending[middle] <= limit) low = middle + 1;
    else high = middle;
  }
  return low;
}

const TICK_M = 1e-3; // Lengths come as float32.

class Episode {
  constructor(data) {
    this.label = data.label;
    this.title = data.yardstick ? `${data.label} (yardstick)` : data.label;
    this.yardstick = data.yardstick;
    this.colour = `--line-${data.colour}`;
    this.dash = data.dash;
    this.outcome = data.outcome;
    this.lengthM = data.length_m;
    this.boustrophedonM = data.boustrophedon_m;
    this.detectedM = numbersOf(data.detected_m, Float32Array);
    this.mowedM = numbersOf(data.mowed_m, Float32Array);
    // Cells share the length of the path out among 65,534 steps; 65,535 means never.
    this.seenStep = numbersOf(data.seen_step, Uint16Array);
    const rows = numbersOf(data.arcs, Float32Array);
    this.arcs = [];
    let sinceM = 0;
    for (let i = 0; i < rows.length; i += 5) {
      const [x, y, heading, curvature, length] = rows.subarray(i, i + 5);
      this.arcs.push({ x, y, heading, curvature, length, sinceM });
      sinceM += length;
    }
    const [x, y, heading] = data.start;
    this.start = { x, y, heading };
    this.arcStartsM = this.arcs.map((arc) => arc.sinceM);
    this.mowedOrderM = this.mowedM.filter(Number.isFinite).sort();
    // A weed may be mowed undetected.
    this.metM = this.detectedM.map((detectedM, weed) => Math.min(detectedM, this.mowedM[weed]));
    this.seenM = numbersOf(data.seen_m, Float32Array);
  }

  isOver(pathM) {
    return pathM >= this.lengthM - TICK_M;
  }

  // Where the mower is: metres and radians.
  poseAt(pathM) {
    const arc = this.arcs[Math.max(0, countUpTo(this.arcStartsM, pathM) - 1)];
    if (!arc) return this.start;
    const along = Math.max(0, Math.min(pathM - arc.sinceM, arc.length));
    const heading = arc.heading + arc.curvature * along;
    if (Math.abs(arc.curvature) < 1e-6) {
      return { x: arc.x + along * Math.cos(arc.heading), y: arc.y + along * Math.sin(arc.heading), heading };
    }
    return {
      x: arc.x + (Math.sin(heading) - Math.sin(arc.heading)) / arc.curvature,
      y: arc.y - (Math.cos(heading) - Math.cos(arc.heading)) / arc.curvature,
      heading,
    };
  }

  // Traces the path driven so far, in metres.
  trace(context, pathM) {
    context.beginPath();
    for (const arc of this.arcs) {
      const along = Math.min(pathM - arc.sinceM, arc.length);
      if (along <= 0) break;
      if (arc.sinceM === 0) context.moveTo(arc.x, arc.y);
      if (Math.abs(arc.curvature) < 1e-6) {
        context.lineTo(arc.x + along * Math.cos(arc.heading), arc.y + along * Math.sin(arc.heading));
        continue;
      }
      const radius = 1 / arc.curvature;
      const from = arc.heading - Math.PI / 2 + (radius < 0 ? Math.PI : 0);
      const centreX = arc.x - radius * Math.sin(arc.heading);
      const centreY = arc.y + radius * Math.cos(arc.heading);
      context.arc(centreX, centreY, Math.abs(radius), from, from + arc.curvature * along, radius < 0);
    }
  }

  isWeedMowed(weed, pathM) {
    return this.mowedM[weed] <= pathM + TICK_M;
  }

  isWeedDetected(weed, pathM) {
    return this.detectedM[weed] <= pathM + TICK_M;
  }

  seenStepAt(pathM) {
    return Math.round((65534 * Math.min(pathM, this.lengthM)) / (this.lengthM || 1));
  }

  // The numbers below a picture: each weed is in one state.
  countsAt(pathM) {
    const mowed = countUpTo(this.mowedOrderM, pathM + TICK_M);
    const met = this.metM.filter((metM) => metM <= pathM + TICK_M).length;
    return {
      pathM: Math.min(pathM, this.lengthM),
      mowed,
      detected: met - mowed,
      undetected: this.mowedM.length - met,
      // Whole thousandths: what is not whole is not called whole.
      seenPercent: (countUpTo(this.seenM, pathM + TICK_M) - 1) / 10,
    };
  }
}
