// Frames as recordings of a page hold them: docs/protocol.md#frames.

import { EXACT, HEADER } from "../frames.js";

// Encode the present moment of a game, with exact positions and velocities, in base64.
export function encode({ positions, velocities, teams, tick }) {
  const count = teams.length, teamsAt = HEADER + 16 * count, bytes = new Uint8Array(teamsAt + ((count + 7) >> 3)), view = new DataView(bytes.buffer);
  bytes.set([1, EXACT]);
  view.setUint16(2, count, true);
  view.setUint32(8, tick, true);
  [...positions, ...velocities].forEach((value, i) => view.setFloat32(HEADER + 4 * i, value, true));
  teams.forEach((team, i) => { bytes[teamsAt + (i >> 3)] |= team << (i & 7); });
  return btoa(String.fromCharCode(...bytes));
}
