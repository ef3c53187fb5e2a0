// Binary messages as docs/protocol.md describes them: frames and targets.
// Everything is little-endian; grids are [row = y, column = x], row 0 at the bottom.

export const FRAME = "frame", TARGET = "target";
export const CELLS = 50; // per side of a field
export const CAPTURES_FROM = 192; // a team captures where its field is at least this
export const NEARLY_FROM = 128; // half of the largest value: it nearly captures
const WITH_ALTITUDES = 1, WITH_FIELDS = 2, HIDDEN = [4, 8]; // red's drones, or blue's, are hidden
const EXACT = 16; // in recordings of a page: positions and velocities are float32
const HEADER = 20, TARGET_HEADER = 8, FASTEST = 4; // FASTEST in map widths a second

export function decode(buffer) {
  const view = new DataView(buffer);
  return view.getUint8(0) === 1 ? decodeFrame(view, buffer) : decodeTarget(view, buffer);
}

function decodeFrame(view, buffer) {
  const flags = view.getUint8(1), count = view.getUint16(2, true), isExact = flags & EXACT, size = isExact ? 8 : 4, cells = CELLS * CELLS;
  const teamsAt = HEADER + 2 * size * count, fieldsAt = teamsAt + ((count + 7) >> 3) + (flags & WITH_ALTITUDES ? count : 0); // altitudes are not shown
  const numbers = (Kind, at, largest) => Float32Array.from(new Kind(buffer, HEADER + at * size * count, 2 * count), (value) => value / largest);
  const game = {
    tick: view.getUint32(8, true), positions: isExact ? numbers(Float32Array, 0, 1) : numbers(Uint16Array, 0, 65535),
    velocities: isExact ? numbers(Float32Array, 1, 1) : numbers(Int16Array, 1, 32767 / FASTEST),
    teams: Uint8Array.from({ length: count }, (_, i) => view.getUint8(teamsAt + (i >> 3)) >> (i & 7) & 1),
  };
  const field = (from) => new Uint8Array(buffer.slice(from, from + cells)), fields = flags & WITH_FIELDS ? [field(fieldsAt), field(fieldsAt + cells)] : null;
  return { sequence: view.getUint32(4, true), ...momentOf(game, view.getFloat64(12, true), fields, HIDDEN.findIndex((flag) => flags & flag)) };
}

// Return the present frame of a game. Drones of the `hidden` team are NaN, where canvases paint nothing.
export function momentOf({ tick, positions, velocities, teams }, serverMs, fields, hidden = -1) {
  const shown = (values) => values.map((value, i) => (teams[i >> 1] === hidden ? NaN : value));
  return { type: FRAME, tick, serverMs, positions: shown(positions), velocities: shown(velocities), teams: teams.slice(), fields };
}

// Return the sizes of red and blue.
export function sizesOf(teams) {
  const blue = teams.reduce((sum, team) => sum + team, 0);
  return [teams.length - blue, blue];
}

function decodeTarget(view, buffer) {
  return { type: TARGET, team: view.getUint8(1), number: view.getUint32(4, true), picture: new Uint8Array(buffer.slice(TARGET_HEADER)) };
}

// Encode the present moment of a game as recordings of a page hold it: exact, without fields, in base64.
export function encode({ positions, velocities, teams, tick }) {
  const count = teams.length, teamsAt = HEADER + 16 * count, bytes = new Uint8Array(teamsAt + ((count + 7) >> 3)), view = new DataView(bytes.buffer);
  bytes.set([1, EXACT]);
  view.setUint16(2, count, true);
  view.setUint32(8, tick, true);
  [...positions, ...velocities].forEach((value, i) => view.setFloat32(HEADER + 4 * i, value, true));
  teams.forEach((team, i) => { bytes[teamsAt + (i >> 3)] |= team << (i & 7); });
  return btoa(String.fromCharCode(...bytes));
}
