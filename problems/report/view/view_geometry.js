// SPDX-License-Identifier: GPL-3.0-or-later
// Converts a scene's blobs (view_mesh.h) to three.js objects, and millimetres to colours.
'use strict';
const SemblanceGeometry = (() => {
  const NO_VALUE = -32768;

  const decodeBytes = (base64) => {
    const text = atob(base64), bytes = new Uint8Array(text.length);
    for (let k = 0; k < text.length; ++k) { bytes[k] = text.charCodeAt(k); }
    return bytes.buffer;
  };

  const decodePoints = (blob) => {
    const numbers = new Uint16Array(decodeBytes(blob.points)), positions = new Float32Array(numbers.length);
    for (let k = 0; k < numbers.length; ++k) { positions[k] = blob.low[k % 3] + blob.step * numbers[k]; }
    return positions;
  };

  const decodeIndex = (base64, points) => {
    const bytes = decodeBytes(base64);
    return points <= 65536 ? new Uint16Array(bytes) : new Uint32Array(bytes);
  };

  // A mesh with smooth normals of its simplified triangles, or lines.
  const geometryOf = (blob) => {
    const geometry = new THREE.BufferGeometry(), positions = decodePoints(blob);
    geometry.setAttribute('position', new THREE.BufferAttribute(positions, 3));
    geometry.setIndex(new THREE.BufferAttribute(
        decodeIndex(blob.triangles || blob.segments, positions.length / 3), 1));
    if (blob.triangles) { geometry.computeVertexNormals(); }
    return geometry;
  };

  // One number in mm per vertex. NaN where there is no value.
  const valuesOf = (blob) =>
      Float32Array.from(new Int16Array(decodeBytes(blob.values)), (n) => n === NO_VALUE ? NaN : n / 100);

  // The ends of a colour map. range_mm, if given, replaces both ends of a map around 0.
  const domainOf = (map, range_mm) =>
      map.low_mm < 0 && range_mm ? [-range_mm, range_mm] : [map.low_mm, map.high_mm];

  const coloursOf = (values, map, range_mm) => {
    const [low, high] = domainOf(map, range_mm), steps = map.colours.length - 1;
    const control = map.colours.map((c) => new THREE.Color(c)), noData = new THREE.Color(map.no_data);
    const colours = new Float32Array(3 * values.length), mixed = new THREE.Color();
    for (let v = 0; v < values.length; ++v) {
      if (isNaN(values[v])) {
        mixed.copy(noData);
      } else {
        const t = steps * Math.min(1, Math.max(0, (values[v] - low) / (high - low)));
        const k = Math.min(steps - 1, Math.floor(t));
        mixed.copy(control[k]).lerp(control[k + 1], t - k);
      }
      mixed.toArray(colours, 3 * v);
    }
    return new THREE.BufferAttribute(colours, 3);
  };

  // The distance in mm of each vertex outside (+) or inside (-) another surface, measured from the other surface's
  // nearest vertex along its normal. NaN beyond `reach`. Accurate to a fraction of the triangles' size.
  const outsideOf = (geometry, other, reach) => {
    const from = geometry.attributes.position.array, to = other.attributes.position.array, normals = other.attributes.normal.array;
    const cell = reach / 2, cells = new Map();
    const key = (x, y, z) => `${x},${y},${z}`, at = (value) => Math.floor(value / cell);
    for (let v = 0; v < to.length / 3; ++v) {
      const name = key(at(to[3 * v]), at(to[3 * v + 1]), at(to[3 * v + 2]));
      if (!cells.has(name)) { cells.set(name, []); }
      cells.get(name).push(v);
    }
    return Float32Array.from({length: from.length / 3}, (_, v) => {
      const p = [from[3 * v], from[3 * v + 1], from[3 * v + 2]], c = p.map(at);
      let nearest = reach * reach, best = -1;
      for (let x = c[0] - 2; x <= c[0] + 2; ++x) {
        for (let y = c[1] - 2; y <= c[1] + 2; ++y) {
          for (let z = c[2] - 2; z <= c[2] + 2; ++z) {
            for (const w of cells.get(key(x, y, z)) || []) {
              const d = (p[0] - to[3 * w]) ** 2 + (p[1] - to[3 * w + 1]) ** 2 + (p[2] - to[3 * w + 2]) ** 2;
              if (d < nearest) { nearest = d; best = w; }
            }
          }
        }
      }
      return best < 0 ? NaN : p.reduce((sum, x, k) => sum + (x - to[3 * best + k]) * normals[3 * best + k], 0);
    });
  };

  const vector = (numbers) => new THREE.Vector3().fromArray(numbers);

  // Scenes have many rods and balls, so all share one geometry.
  const once = (make) => { let made = null; return () => made || (made = make()); };
  const rod = once(() => new THREE.CylinderBufferGeometry(1, 1, 1, 12)), sphere = once(() => new THREE.SphereBufferGeometry(1, 16, 12));

  const cylinder = (from, to, radius, material) => {
    const along = to.clone().sub(from), length = along.length();
    const mesh = new THREE.Mesh(rod(), material);
    mesh.scale.set(radius, length, radius);
    mesh.position.copy(from).addScaledVector(along, 0.5);
    mesh.visible = length > 0;  // a rod without length has no normals
    if (length > 0) {
      mesh.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), along.divideScalar(length));
    }
    return mesh;
  };

  const ball = (at, radius, material) => {
    const mesh = new THREE.Mesh(sphere(), material);
    mesh.scale.setScalar(radius);
    mesh.position.copy(at);
    return mesh;
  };

  return {geometryOf, valuesOf, domainOf, coloursOf, outsideOf, vector, cylinder, ball};
})();
