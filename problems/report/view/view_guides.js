// SPDX-License-Identifier: GPL-3.0-or-later
// Aids for reading a 3-D view: a compass with the names of the head's sides, and the legend of a colour map.
'use strict';
const SemblanceGuides = (() => {
  const element = (tag, properties, ...children) => {
    const made = Object.assign(document.createElement(tag), properties);
    made.append(...children);
    return made;
  };

  // Draws on a square canvas in its text colour. `names` are those of +x, -x, +y, -y, +z and -z.
  const HEAD = ['left', 'right', 'back', 'front', 'up', 'down'];
  const drawCompass = (compass, camera, names = HEAD) => {
    const pen = compass.getContext('2d'), middle = compass.width / 2;
    const turn = camera.quaternion.clone().inverse();
    pen.clearRect(0, 0, compass.width, compass.height);
    pen.font = '20px system-ui, sans-serif';
    pen.textBaseline = 'middle';
    const ink = getComputedStyle(compass).color;
    const axes = [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]]
        .map((to, k) => ({name: names[k], at: new THREE.Vector3(...to).applyQuaternion(turn)}))
        .sort((a, b) => a.at.z - b.at.z);
    for (const {name, at} of axes) {
      const x = middle + 54 * at.x, y = middle - 54 * at.y;
      pen.globalAlpha = at.z > -0.3 ? 1 : 0.3;
      pen.strokeStyle = pen.fillStyle = ink;
      pen.beginPath();
      pen.moveTo(middle, middle);
      pen.lineTo(x, y);
      pen.stroke();
      // Axes that point away have no name, because it would lie under others. Sideways axes are named at their ends.
      const sideways = Math.abs(at.x) > 0.2, reach = sideways ? 60 : 86;
      pen.textAlign = sideways ? (at.x > 0 ? 'left' : 'right') : 'center';
      if (at.z > -0.3 && at.z < 0.93) { pen.fillText(name, middle + reach * at.x, middle - reach * at.y); }
    }
  };

  // Three figures. Very small and very large numbers have a power of ten, e.g. 1.2e-5.
  const figureOf = (value, scaled) => {
    const is_plain = value === 0 || !scaled || (Math.abs(value) >= 1e-3 && Math.abs(value) < 1e5);
    return `${!is_plain ? value.toExponential(1) : scaled ? +value.toPrecision(3) : +value.toFixed(2)}`.replaceAll('-', '\u2212');
  };

  // The legend of a colour map. range_mm: see SemblanceGeometry.domainOf.
  const legendOf = (map, range_mm) => {
    const [low, high] = SemblanceGeometry.domainOf(map, range_mm);
    const bar = element('div', {className: 'view3d-bar'});
    bar.style.background = `linear-gradient(to right, ${map.colours.join(',')})`;
    const ticks = element('div', {className: 'view3d-ticks'});
    const figures = [0, 1, 2, 3, 4].map((k) => {
      const value = (low + (high - low) * k / 4) * (map.scale || 1), sign = low < 0 && value > 0 ? '+' : '';
      return sign + figureOf(value, Boolean(map.scale));
    });
    const is_long = figures.some((figure) => figure.length > 5);  // five would not fit
    for (const figure of is_long ? [figures[0], figures[2], figures[4]] : figures) { ticks.append(element('span', {textContent: figure})); }
    const none = element('i', {style: `background:${map.no_data}`});
    return element('div', {className: 'view3d-legend'}, element('div', {textContent: map.unit === '' ? map.title : `${map.title} (${map.unit ?? 'mm'})`}),
                   bar, ticks, element('small', {}, none, 'no data'));
  };

  // True if this browser has WebGL.
  const canShow = () => {
    try {
      const canvas = document.createElement('canvas');
      return Boolean(canvas.getContext('webgl2') || canvas.getContext('webgl'));
    } catch (error) {
      return false;
    }
  };

  return {drawCompass, legendOf, canShow};
})();
