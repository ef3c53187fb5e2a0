// Binary messages of the table, as docs/protocol.md describes them: frames and targets.
// Everything is little-endian; grids are [row = y, column = x], row 0 at the bottom.

export const FRAME = 1, TARGET = 2;
const KEYFRAME = 1, WITH_FIELDS = 2, HIDDEN = [4, 8]; // of red's drones, and blue's, it does not tell where they are
const HEADER = 20, TARGET_HEADER = 8, CELLS = 50, FASTEST = 4;

export function decode(buffer) {
  const kind = new DataView(buffer).getUint8(0);
  if (kind === FRAME) return decodeFrame(buffer);
  if (kind === TARGET) return decodeTarget(buffer);
  throw new Error(`a binary message must begin with byte ${FRAME} or ${TARGET}, got ${kind}`);
}

function decodeFrame(buffer) {
  const view = new DataView(buffer);
  const flags = view.getUint8(1), count = view.getUint16(2, true);
  const bits = (count + 7) >> 3;
  const length = HEADER + 8 * count + bits + (flags & KEYFRAME ? count : 0) + (flags & WITH_FIELDS ? 2 * CELLS * CELLS : 0);
  if (buffer.byteLength !== length) throw new Error(`a frame of ${count} drones has ${length} bytes, got ${buffer.byteLength}`);
  const positions = new Float32Array(2 * count), velocities = new Float32Array(2 * count);
  for (let i = 0; i < 2 * count; i++) {
    positions[i] = view.getUint16(HEADER + 2 * i, true) / 65535;
    velocities[i] = view.getInt16(HEADER + 4 * count + 2 * i, true) / 32767 * FASTEST;
  }
  const teams = new Uint8Array(count);
  let at = HEADER + 8 * count;
  const hidden = HIDDEN.findIndex((flag) => flags & flag);
  for (let i = 0; i < count; i++) {
    teams[i] = view.getUint8(at + (i >> 3)) >> (i & 7) & 1;
    // Nowhere: what is painted there is not painted.
    if (teams[i] === hidden) for (const told of [positions, velocities]) told.fill(NaN, 2 * i, 2 * i + 2);
  }
  at += bits;
  let altitudes = null, fields = null;
  if (flags & KEYFRAME) {
    altitudes = new Uint8Array(buffer.slice(at, at + count));
    at += count;
  }
  if (flags & WITH_FIELDS) {
    const cells = CELLS * CELLS;
    fields = [new Uint8Array(buffer.slice(at, at + cells)), new Uint8Array(buffer.slice(at + cells, at + 2 * cells))];
  }
  return {
    kind: FRAME, sequence: view.getUint32(4, true), tick: view.getUint32(8, true), serverMs: view.getFloat64(12, true),
    positions, velocities, teams, altitudes, fields,
  };
}

function decodeTarget(buffer) {
  const view = new DataView(buffer);
  const cells = view.getUint16(2, true);
  if (buffer.byteLength !== TARGET_HEADER + cells * cells) throw new Error(`a target of ${cells} cells a side is cut short`);
  return {
    kind: TARGET, team: view.getUint8(1), number: view.getUint32(4, true), cells,
    picture: new Uint8Array(buffer.slice(TARGET_HEADER)),
  };
}
