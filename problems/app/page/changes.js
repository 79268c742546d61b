// SPDX-License-Identifier: GPL-3.0-or-later
// Distances in mm between two faces with the same vertices, along the normals of the former face; outwards is positive.

export const changeBetween = (former, now) => {
  const a = former.attributes.position, b = now.attributes.position, normals = former.attributes.normal.array;
  if (a.count !== b.count) { return null; }
  const values = new Float32Array(a.count);
  for (let v = 0; v < a.count; ++v) {
    let sum = 0;
    for (let k = 3 * v; k < 3 * v + 3; ++k) { sum += (b.array[k] - a.array[k]) * normals[k]; }
    values[v] = sum;
  }
  return values;
};

// {most, mean}: maximum and mean of the absolute changes in mm.
export const sizeOf = (values) => {
  let most = 0, sum = 0;
  for (const value of values) {
    most = Math.max(most, Math.abs(value));
    sum += Math.abs(value);
  }
  return {most, mean: values.length ? sum / values.length : 0};
};
