// The curves below the pictures: weeds mowed over the path driven, a line for each agent.

class Race {
  constructor(canvas, episodes) {
    Object.assign(this, { canvas, episodes });
    this.longestM = Math.max(...episodes.map((episode) => episode.lengthM), 1);
    this.weeds = Math.max(1, episodes[0].mowedM.length);
  }

  draw(pathM, colours) {
    const { canvas, longestM, weeds } = this;
    const width = canvas.clientWidth;
    if (!width) return;
    const height = 150;
    const context = fitted(canvas, width, height);
    const margin = { left: 50, right: 14, top: 10, bottom: 38 };
    const x = (metres) => margin.left + ((width - margin.left - margin.right) * metres) / longestM;
    const y = (count) => height - margin.bottom - ((height - margin.top - margin.bottom) * count) / (1.06 * weeds);
    context.fillStyle = colours.paper;
    context.fillRect(0, 0, width, height);
    this.drawGrid(context, x, y, width, height, margin, colours);
    for (const episode of this.episodes) this.drawLine(context, episode, pathM, x, y);
    context.strokeStyle = colours.ink;
    context.lineWidth = 1;
    context.beginPath();
    context.moveTo(x(pathM), margin.top);
    context.lineTo(x(pathM), height - margin.bottom);
    context.stroke();
  }

  drawGrid(context, x, y, width, height, margin, colours) {
    const { longestM, weeds } = this;
    context.font = FONT;
    context.fillStyle = colours.ink;
    context.strokeStyle = colours.muted;
    context.lineWidth = 1;
    context.strokeRect(x(0), margin.top, x(longestM) - x(0), y(0) - margin.top);
    context.textBaseline = "top";
    context.textAlign = "center";
    for (const metres of ticksOf(0, longestM, Math.min(10, width / 80))) {
      context.fillRect(x(metres) - 0.5, y(0), 1, 4);
      context.fillText(String(metres), x(metres), y(0) + 6);
    }
    context.fillText("path driven in m", 0.5 * (x(0) + x(longestM)), y(0) + 21);
    context.textAlign = "right";
    context.textBaseline = "middle";
    for (const count of ticksOf(0, weeds, 4).filter(Number.isInteger)) {
      context.fillRect(x(0) - 4, y(count) - 0.5, 4, 1);
      context.fillText(String(count), x(0) - 6, y(count));
    }
    context.save();
    context.translate(10, 0.5 * (margin.top + y(0)));
    context.rotate(-Math.PI / 2);
    context.textAlign = "center";
    context.fillText("weeds mowed", 0, 0);
    context.restore();
  }

  // What has been driven in full, what is still to come faintly.
  drawLine(context, episode, pathM, x, y) {
    const colour = colourOf(episode.colour, this.canvas);
    const trace = (limitM) => {
      context.beginPath();
      context.moveTo(x(0), y(0));
      let count = 0;
      for (const metres of episode.mowedOrderM) {
        if (metres > limitM) break;
        context.lineTo(x(metres), y(count));
        count += 1;
        context.lineTo(x(metres), y(count));
      }
      context.lineTo(x(Math.min(limitM, episode.lengthM)), y(count));
      context.stroke();
      return count;
    };
    context.strokeStyle = colour;
    context.fillStyle = colour;
    context.lineWidth = 1.6;
    context.globalAlpha = 0.45;
    context.setLineDash(episode.dash);
    trace(episode.lengthM);
    context.globalAlpha = 1;
    context.lineWidth = 2.2;
    const count = trace(pathM);
    context.setLineDash([]);
    context.beginPath();
    context.arc(x(Math.min(pathM, episode.lengthM)), y(count), 3.5, 0, 2 * Math.PI);
    context.fill();
  }
}
