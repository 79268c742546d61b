// SPDX-License-Identifier: GPL-3.0-or-later
// The section at the cut of the 3-D view: outlines of the visible surfaces in the plane, in mm.
'use strict';
class SemblanceSection {
  // digits: decimals of the plane's place.
  constructor(unit, digits) {
    this.unit = unit;
    this.digits = digits;
    this.element = document.createElement('figure');
    this.element.className = 'view3d-section';
    this.element.hidden = true;
    this.state = '';
  }

  // The segments in which the plane `axis` = at cuts the surface, as the data of an SVG path. A vertex in the plane
  // counts as being above it.
  static pathOf(geometry, axis, at, toPicture) {
    const index = geometry.index.array, points = geometry.attributes.position.array, path = [];
    const crossing = (a, b) => {
      const share = (at - points[3 * a + axis]) / (points[3 * b + axis] - points[3 * a + axis]);
      return toPicture([0, 1, 2].map((k) => points[3 * a + k] + share * (points[3 * b + k] - points[3 * a + k])));
    };
    for (let t = 0; t < index.length; t += 3) {
      const ends = [];
      for (let k = 0; k < 3; ++k) {
        const a = index[t + k], b = index[t + (k + 1) % 3];
        if ((points[3 * a + axis] >= at) !== (points[3 * b + axis] >= at)) { ends.push(crossing(a, b)); }
      }
      if (ends.length === 2) { path.push(`M${ends[0].map((x) => x.toFixed(2)).join(' ')}L${ends[1].map((x) => x.toFixed(2)).join(' ')}`); }
    }
    return path.join('');
  }

  // Axes of the picture: the subject's right on its left, or the front on its left; up is up, or the front.
  static pictures = [{right: 1, down: 2, sign: -1, ends: ['front', 'back']}, {right: 0, down: 2, sign: -1, ends: ['right', 'left']},
                     {right: 0, down: 1, sign: 1, ends: ['right', 'left']}];

  // Draws the section of what the stage shows. clip: {axis: 'none', 'left', 'back' or 'up', at: 0..1}.
  show(stage, clip, box) {
    const axis = ['left', 'back', 'up'].indexOf(clip.axis);
    const shown = axis < 0 ? [] : [...stage.layers.values()].filter(({layer, object}) => layer.mesh && object.visible);
    const state = JSON.stringify([clip.axis, clip.at, shown.map(({object}) => object.geometry.uuid)]);
    if (state === this.state) { return; }
    this.state = state;
    this.element.hidden = axis < 0;
    if (axis >= 0) { this.draw(shown, axis, clip.at, box, stage.description.axes); }
  }

  draw(shown, axis, share, box, ownAxes) {
    const {right, down, sign, ends} = SemblanceSection.pictures[axis], low = box.min.toArray(), high = box.max.toArray();
    const at = low[axis] + (high[axis] - low[axis]) * share, toPicture = (p) => [p[right], sign * p[down]];
    const x = low[right], width = high[right] - x, y = sign > 0 ? low[down] : -high[down], height = high[down] - low[down];
    const scale = 10 ** Math.floor(Math.log10(width / 2.5)), length = width / scale > 12 ? 5 * scale : 2 * scale;
    const line = (path, colour) => `<path d="${path}" fill="none" stroke="${colour}" stroke-width="1.5" vector-effect="non-scaling-stroke"/>`;
    const rows = shown.map(({layer, object}) => [layer, SemblanceSection.pathOf(object.geometry, axis, at, toPicture)])
        .filter(([, path]) => path);
    const svg = `<svg viewBox="${x} ${y} ${width} ${height}" role="img">${
        rows.map(([layer, path]) => line(path, SemblanceSection.colourOf(layer))).join('')}${
        line(`M${x + 0.03 * width} ${y + 0.97 * height}h${length}`, 'currentColor')}</svg>`;
    const caption = document.createElement('figcaption');
    const words = ownAxes ? '' : `${ends[0]} on the left, ${ends[1]} on the right; `;
    caption.append(`${'xyz'[axis]} = ${at.toFixed(this.digits)}${this.unit}; ${words}bar: ${length}${this.unit}`);
    this.element.innerHTML = svg;
    this.element.firstChild.setAttribute('aria-label', `section of ${rows.map(([layer]) => layer.label).join(', ') || 'nothing'}`);
    for (const [layer] of rows) {
      const row = document.createElement('div'), key = document.createElement('i');
      key.style.background = SemblanceSection.colourOf(layer);
      row.append(key, layer.label);
      caption.append(row);
    }
    this.element.append(caption);
  }

  // The layers' own colours are too pale for lines.
  static colourOf(layer) {
    return {skull: '#8a5a00', implicit: '#0072b2', face: '#d55e00', skin: '#009e73', bust: '#cc79a7', head: '#cc79a7'}[layer.id] || '#767676';
  }
}
