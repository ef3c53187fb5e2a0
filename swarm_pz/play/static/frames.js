// Binary messages of the table, as docs/protocol.md describes them: frames and targets.
// Everything is little-endian; grids are [row = y, column = x], row 0 at the bottom.

export const FRAME = "frame", TARGET = "target";
export const CELLS = 50; // of a field, a side
export const CAPTURES_FROM = 192; // value of a field: a team captures there
export const NEARLY_FROM = 128; // half of the largest: it nearly does
const KINDS = { 1: decodeFrame, 2: decodeTarget };
export const WITH_ALTITUDES = 1, WITH_FIELDS = 2, HIDDEN = [4, 8]; // red's drones, or blue's, are hidden
export const EXACT = 16; // of a recording in a page: numbers have 32 bits
export const HEADER = 20, TARGET_HEADER = 8, FASTEST = 4;

export function decode(buffer) {
  const view = new DataView(buffer), kind = view.getUint8(0);
  if (!(kind in KINDS)) throw new Error(`a binary message must begin with byte ${Object.keys(KINDS).join(" or ")}, got ${kind}`);
  return KINDS[kind](view, buffer);
}

function decodeFrame(view, buffer) {
  const flags = view.getUint8(1), count = view.getUint16(2, true), bits = (count + 7) >> 3, cells = CELLS * CELLS;
  const isExact = flags & EXACT, size = isExact ? 8 : 4; // bytes of a drone's position, and of its velocity
  const teamsAt = HEADER + 2 * size * count, fieldsAt = teamsAt + bits + (flags & WITH_ALTITUDES ? count : 0); // altitudes are not shown
  const length = fieldsAt + (flags & WITH_FIELDS ? 2 * cells : 0);
  if (buffer.byteLength !== length) throw new Error(`a frame of ${count} drones has ${length} bytes, got ${buffer.byteLength}`);
  const positions = new Float32Array(2 * count), velocities = new Float32Array(2 * count);
  for (let i = 0; i < 2 * count; i++) {
    const x = HEADER + i * size / 2, v = x + size * count;
    positions[i] = isExact ? view.getFloat32(x, true) : view.getUint16(x, true) / 65535;
    velocities[i] = isExact ? view.getFloat32(v, true) : view.getInt16(v, true) / 32767 * FASTEST;
  }
  const teams = new Uint8Array(count), hidden = HIDDEN.findIndex((flag) => flags & flag);
  for (let i = 0; i < count; i++) {
    teams[i] = view.getUint8(teamsAt + (i >> 3)) >> (i & 7) & 1;
    // Canvases paint nothing at NaN.
    if (teams[i] === hidden) for (const told of [positions, velocities]) told.fill(NaN, 2 * i, 2 * i + 2);
  }
  const take = (from, size) => new Uint8Array(buffer.slice(from, from + size));
  return {
    type: FRAME, sequence: view.getUint32(4, true), tick: view.getUint32(8, true), serverMs: view.getFloat64(12, true),
    positions, velocities, teams, fields: flags & WITH_FIELDS ? [take(fieldsAt, cells), take(fieldsAt + cells, cells)] : null,
  };
}

function decodeTarget(view, buffer) {
  const cells = view.getUint16(2, true);
  if (buffer.byteLength !== TARGET_HEADER + cells * cells) throw new Error(`a target of ${cells} cells a side is cut short`);
  return {
    type: TARGET, team: view.getUint8(1), number: view.getUint32(4, true), cells,
    picture: new Uint8Array(buffer.slice(TARGET_HEADER)),
  };
}
