/** Sums with single numbers, and how they are written. */

export function clamped(value: number, low: number, high: number): number {
  return Math.min(Math.max(value, low), high);
}

/** As fine as forces and places are set by hand. */
export function hundredths(value: number): number {
  return Math.round(value * 100) / 100;
}

export function largest(values: ArrayLike<number>): number {
  let peak = 0;
  for (let i = 0; i < values.length; i++) peak = Math.max(peak, Math.abs(values[i]));
  return peak;
}

/** The smallest of 1, 2, 5, 10, ... that is not below a value, so that scales stay calm. */
export function niceAbove(value: number, factors: number[] = [1, 2, 5, 10]): number {
  if (!(value > 0)) return 1;
  const decade = 10 ** Math.floor(Math.log10(value));
  const step = factors.find((factor) => factor * decade >= value * (1 - 1e-9)) ?? 10;
  return Number((step * decade).toPrecision(2));
}

/** With so many decimals, a true minus sign, and no sign of nothing. */
export function fixed(value: number, digits: number): string {
  if (!Number.isFinite(value)) return "–";
  return (Math.abs(value) < 0.5 * 10 ** -digits ? 0 : value).toFixed(digits).replace("-", "−");
}
