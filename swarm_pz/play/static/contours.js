// Contour lines of a grid of values, by marching squares: pieces of line between cell centres.

// Call piece(x0, y0, x1, y1), in map widths, for each piece of the line at a level.
export function trace(values, cells, level, piece) {
  const at = (column, row) => values[row * cells + column];
  const cross = (a, b) => (level - a) / (b - a);
  const place = (index) => (index + 0.5) / cells;
  for (let row = 0; row < cells - 1; row++) {
    for (let column = 0; column < cells - 1; column++) {
      const a = at(column, row), b = at(column + 1, row), c = at(column + 1, row + 1), d = at(column, row + 1);
      const which = [a, b, c, d].reduce((bits, value, i) => bits | Number(value > level) << i, 0);
      if (which === 0 || which === 15) continue;
      const south = () => [place(column + cross(a, b)), place(row)];
      const east = () => [place(column + 1), place(row + cross(b, c))];
      const north = () => [place(column + cross(d, c)), place(row + 1)];
      const west = () => [place(column), place(row + cross(a, d))];
      const line = (from, to) => piece(...from, ...to);
      const turned = which > 7 ? 15 - which : which;
      if (turned === 1) line(west(), south());
      else if (turned === 2) line(south(), east());
      else if (turned === 3) line(west(), east());
      else if (turned === 4) line(east(), north());
      else if (turned === 6) line(south(), north());
      else if (turned === 7) line(west(), north());
      else if (which === 5) { line(west(), south()); line(east(), north()); }
      else { line(south(), east()); line(west(), north()); }
    }
  }
}
