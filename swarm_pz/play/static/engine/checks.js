// Valid values for games without a server, so that Python can read their recordings.

export class Refused extends Error {
  code;

  constructor(code, reason) {
    super(reason);
    this.code = code;
  }
}

const number = (low, high) => (value) => typeof value === "number" && value >= low && value <= high;
const whole = (low, high) => (value) => Number.isInteger(value) && value >= low && value <= high;
const either = (...values) => (value) => values.includes(value);
const periods = (value) => value === null || (number(1, 36_000)(value) && Math.abs(10 * value - Math.round(10 * value)) < 1e-6);

export const SETTINGS = {
  red: whole(0, 200), blue: whole(0, 200), time_limit: periods, speed: number(0.25, 2),
  majority: either(true, false), red_system: either(null, "ergodic"), blue_system: either(null, "ergodic"),
};
export const FACTORS = {
  command_delay_ms: number(0, 5000), display_delay_ms: number(0, 5000), frame_rate: whole(1, 30), speed: number(0.25, 2),
  hide: (names) => Array.isArray(names) && names.every(either("opponents", "ground", "trails", "target")), share: either(0), helper: either(""),
};
export const ADDRESS = {
  countdown: number(0, 60),
  factors: (factors) => factors?.constructor === Object && Object.keys(factors).every(either("red", "blue")),
};
export const GAME = { seed: (seed) => seed === null || whole(0, 2 ** 32 - 1)(seed), seat: either("red", "blue") };

// Refuse invalid values and unknown names.
export function check(values, fits) {
  for (const [name, value] of Object.entries(values)) {
    if (!Object.hasOwn(fits, name)) throw new Refused("not_valid", `there is no ${name}; known are ${Object.keys(fits).join(", ")}`);
    if (!fits[name](value)) throw new Refused("not_valid", `${name} cannot be ${JSON.stringify(value)} where no server is`);
  }
}
