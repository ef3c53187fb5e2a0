// Team sizes over time: red from below, blue from above, told apart by hatching, too.

import { COLOURS } from "./arena.js";

export class Chart {
  constructor(canvas) {
    this.canvas = canvas;
    this.sizes = [];
  }

  // Sizes of red and blue, one entry a second.
  set(sizes) {
    this.sizes = sizes.map((entry) => [...entry]);
    this.paint();
  }

  add(tick, red, blue) {
    const second = Math.floor(tick / 30);
    const last = this.sizes[second];
    if (last && last[0] === red) return;
    while (this.sizes.length < second) this.sizes.push([...(this.sizes.at(-1) ?? [red, blue])]);
    this.sizes[second] = [red, blue];
    this.paint();
  }

  resize() {
    this.canvas.width = this.canvas.clientWidth * Math.min(devicePixelRatio, 2);
    this.canvas.height = this.canvas.clientHeight * Math.min(devicePixelRatio, 2);
    this.paint();
  }

  paint() {
    const { canvas, sizes } = this, { width, height } = canvas, pen = canvas.getContext("2d");
    pen.fillStyle = "#eef0f2";
    pen.fillRect(0, 0, width, height);
    if (!sizes.length || !width) return;
    const span = Math.max(sizes.length, 30), step = width / span;
    const area = (share) => {
      pen.beginPath();
      sizes.forEach(([red, blue], i) => {
        const y = height * (1 - red / (red + blue || 1));
        pen.rect(i * step, share ? y : 0, step + 0.5, share ? height - y : y);
      });
    };
    pen.fillStyle = COLOURS[0];
    area(true);
    pen.fill();
    pen.fillStyle = COLOURS[1];
    area(false);
    pen.fill();
    pen.strokeStyle = "#fff";
    pen.setLineDash([3, 3]);
    pen.beginPath();
    pen.moveTo(0, height / 2);
    pen.lineTo(width, height / 2);
    pen.stroke();
    pen.setLineDash([]);
    const [red, blue] = sizes.at(-1);
    canvas.setAttribute("aria-label", `Team sizes over time: now red ${red}, blue ${blue}`);
  }
}
