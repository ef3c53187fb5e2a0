// The network of learned players, as in policies/network.py. Every feature exists in the eight orientations of the
// square; their kernels are one kernel, turned and mirrored.

const ORIENTATIONS = 8;

// Return the index of the cell that moves to a place when an image is mirrored (orientations 4 to 7) and then turned.
function sourceOf(orientation, row, column, side) {
  for (let turn = orientation % 4; turn; turn--) [row, column] = [column, side - 1 - row];
  return row * side + (orientation < 4 ? column : side - 1 - column);
}

const SOURCES = Array.from({ length: ORIENTATIONS }, (_, o) => [0, 1, 2, 3].map((cell) => sourceOf(o, cell >> 1, cell & 1, 2)));
// Return the orientation that leads from one to another.
const relative = (from, to) => SOURCES.findIndex((by) => by.every((_, cell) => by[SOURCES[from][cell]] === SOURCES[to][cell]));
const relu = (values) => values.map((value) => Math.max(value, 0));

// Return a function from names to arrays, for a safetensors file.
function tensorsOf(/** @type {ArrayBuffer} */ buffer) {
  const size = 8 + new DataView(buffer).getUint32(0, true), header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 8, size - 8)));
  const read = ({ shape, data_offsets: [from, to] }) => ({ shape, values: new Float32Array(buffer.slice(size + from, size + to)) });
  return (name) => read(header[name]);
}

// Return a convolution, a function of images stored one after the other.
function convolution({ shape: [outputs, inputs, sources, size], values }, { values: bias }, stride = 1, padding = 0) {
  const kernel = new Float64Array(ORIENTATIONS * values.length), square = size * size, block = inputs * sources * square;
  for (let at = 0; at < kernel.length; at++) {
    const output = Math.floor(at / block) % outputs, o = Math.floor(at / block / outputs), input = Math.floor(at / square) % inputs;
    const source = sources > 1 ? relative(o, Math.floor(at / square / inputs) % sources) : 0;
    const cell = sourceOf(o, Math.floor(at % square / size), at % size, size);
    kernel[at] = values[((output * inputs + input) * sources + source) * square + cell];
  }
  return (images, side) => {
    const to = (side + 2 * padding - size) / stride + 1, answers = new Float32Array(ORIENTATIONS * outputs * to * to);
    for (let at = 0; at < answers.length; at++) {
      const output = Math.floor(at / (to * to)), top = Math.floor(at / to) % to * stride - padding, left = at % to * stride - padding;
      let sum = bias[output % outputs];
      for (let first = 0, plane = 0, k = output * block; plane < inputs * sources; plane++, first += side * side) {
        for (let row = top; row < top + size; row++) {
          for (let column = left; column < left + size; column++, k++) {
            if (row >= 0 && row < side && column >= 0 && column < side) sum += kernel[k] * images[first + row * side + column];
          }
        }
      }
      answers[at] = sum;
    }
    return answers;
  };
}

// Read a network from a file of weights: from channels on a grid to log-densities in [-1, 1] on cells.
export function networkOf(/** @type {ArrayBuffer} */ buffer) {
  const tensor = tensorsOf(buffer), head = tensor("head.weight").values, [bias] = tensor("head.bias").values;
  const layer = (name, ...args) => convolution(tensor(`trunk.${name}.weight`), tensor(`trunk.${name}.bias`), ...args);
  const [, planes, , block] = tensor("trunk.near.0.weight").shape, cells = tensor("trunk.whole.0.weight").shape[3], grid = block * cells;
  const first = layer("near.0", block), second = layer("near.2", 1, 1), around = layer("around", 1, 1);
  const gather = layer("whole.0"), summary = layer("whole.2");
  const edge = Float32Array.from({ length: grid }, (_, i) => Math.abs(2 * i / (grid - 1) - 1)); // how far from the middle

  function act(images) {
    const input = Float32Array.from({ length: planes * grid * grid }, (_, i) => images[i] / 255);
    for (let i = 0; i < grid * grid; i++) input[images.length + i] = Math.max(edge[i % grid], edge[Math.floor(i / grid)]);
    const near = relu(second(relu(first(input, grid)), cells)), whole = summary(relu(gather(near, cells)), 1);
    const answers = new Float64Array(cells * cells).fill(bias);
    around(near, cells).forEach((value, i) => {
      const feature = Math.floor(i / answers.length), weight = head[feature % head.length] / ORIENTATIONS;
      answers[i % answers.length] += weight * Math.max(value + whole[feature], 0);
    });
    return answers.map((value) => Math.min(Math.max(value, -1), 1));
  }
  return { channels: planes - 1, grid, cells, act };
}
