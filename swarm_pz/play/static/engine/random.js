// Random numbers as NumPy's default_rng(seed) draws them (SeedSequence and PCG64), so that a game starts here as in Python.

const SIZE = 4; // words of the pool
const LONG = (1n << 64n) - 1n, WHOLE = (1n << 128n) - 1n;
const FACTOR = 0x2360ed051fc65da44385df649fccf645n;

// Return 32-bit words that each depend on every bit of the seed, a whole number below 2**32.
function spread(seed, count) {
  let constant = 0x43b0d7e5;
  const hash = (word, factor) => {
    word ^= constant;
    constant = Math.imul(constant, factor);
    word = Math.imul(word, constant);
    return word ^ word >>> 16;
  };
  const pool = Array.from({ length: SIZE }, (_, i) => hash(i ? 0 : seed, 0x931e8875));
  for (let from = 0; from < SIZE; from++) {
    for (let to = 0; to < SIZE; to++) {
      if (from === to) continue;
      const mixed = Math.imul(0xca01f9dd, pool[to]) - Math.imul(0x4973f715, hash(pool[from], 0x931e8875));
      pool[to] = mixed ^ mixed >>> 16;
    }
  }
  constant = 0x8b51f9dd;
  return Array.from({ length: count }, (_, i) => BigInt(hash(pool[i % SIZE], 0x58f38ded) >>> 0));
}

export class Random {
  constructor(seed) {
    const [a, b, c, d, e, f, g, h] = spread(seed, 2 * SIZE); // each pair of words: the lower one first
    const start = b << 96n | a << 64n | d << 32n | c;
    this.step = (f << 96n | e << 64n | h << 32n | g) << 1n & WHOLE | 1n;
    this.state = (start + this.step) * FACTOR + this.step & WHOLE;
    this.kept = null; // the upper half of a number whose lower half was returned
  }

  long() {
    this.state = this.state * FACTOR + this.step & WHOLE;
    const mixed = (this.state >> 64n ^ this.state) & LONG, turn = this.state >> 122n;
    return (mixed >> turn | mixed << 64n - turn) & LONG;
  }

  // A number in [0, 1).
  next() { return Number(this.long() >> 11n) / 2 ** 53; }

  // A bit: the highest one of half a number, first of the lower half.
  bit() {
    const { kept } = this, both = kept ?? this.long();
    this.kept = kept === null ? both >> 32n : null;
    return Number(both >> 31n & 1n);
  }
}
