// A player without packages: a ring around the middle of the opposing drones. docs/bots.md has the protocol.
//
// swarm-pz evaluate "exec:node examples/bots/ring.js" --opponent noise

const readline = require("node:readline");

// The mean position of an image's brightness, in map widths.
function middle(image) {
  let [total, x, y] = [0, 0, 0];
  image.forEach((row, place) =>
    row.forEach((value, column) => {
      total += value;
      x += value * (column + 0.5);
      y += value * (place + 0.5);
    }),
  );
  return total ? [x / total / image.length, y / total / image.length] : [0.5, 0.5];
}

// A density, row by row from the bottom up: a ring around a point.
function ring([x, y], cells) {
  const along = Array.from({ length: cells }, (_, cell) => (cell + 0.5) / cells);
  return along.map((b) => along.map((a) => Math.exp(-(((Math.hypot(a - x, b - y) - 0.25) / 0.1) ** 2))));
}

let cells = 10;
readline.createInterface({ input: process.stdin }).on("line", (line) => {
  const told = JSON.parse(line);
  if ("swarm_pz" in told) {
    cells = told.rules.command_cells;
    const observation = { kind: "grids", grid: 10, channels: ["opposing_positions"] };
    console.log(JSON.stringify({ swarm_pz: 1, observation }));
  } else if ("see" in told) {
    console.log(JSON.stringify({ turn: told.turn, density: ring(middle(told.see[0]), cells) }));
  }
});
