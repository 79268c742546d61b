// SPDX-License-Identifier: GPL-3.0-or-later
// What helps to read a 3-D view: a compass that names the head's sides, and the legend of a colour map.
'use strict';
const SemblanceGuides = (() => {
  const element = (tag, properties, ...children) => {
    const made = Object.assign(document.createElement(tag), properties);
    made.append(...children);
    return made;
  };

  // compass: a square canvas, drawn in its own colour of text.
  // names: of +x, -x, +y, -y, +z and -z.
  const HEAD = ['left', 'right', 'back', 'front', 'up', 'down'];
  const drawCompass = (compass, camera, names = HEAD) => {
    const pen = compass.getContext('2d'), middle = compass.width / 2;
    const turn = camera.quaternion.clone().inverse();
    pen.clearRect(0, 0, compass.width, compass.height);
    pen.font = '20px system-ui, sans-serif';
    pen.textAlign = 'center';
    pen.textBaseline = 'middle';
    const ink = getComputedStyle(compass).color;
    const axes = [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]]
        .map((to, k) => ({name: names[k], at: new THREE.Vector3(...to).applyQuaternion(turn)}))
        .sort((a, b) => a.at.z - b.at.z);
    for (const {name, at} of axes) {
      const x = middle + 62 * at.x, y = middle - 62 * at.y;
      pen.globalAlpha = at.z > -0.3 ? 1 : 0.3;
      pen.strokeStyle = pen.fillStyle = ink;
      pen.beginPath();
      pen.moveTo(middle, middle);
      pen.lineTo(x, y);
      pen.stroke();
      if (Math.abs(at.z) < 0.93) { pen.fillText(name, middle + 84 * at.x, middle - 84 * at.y); }
    }
  };

  // range_mm: as SemblanceGeometry.domainOf takes it.
  const legendOf = (map, range_mm) => {
    const [low, high] = SemblanceGeometry.domainOf(map, range_mm);
    const bar = element('div', {className: 'view3d-bar'});
    bar.style.background = `linear-gradient(to right, ${map.colours.join(',')})`;
    const ticks = element('div', {className: 'view3d-ticks'});
    for (let k = 0; k <= 4; ++k) {
      const value = (low + (high - low) * k / 4) * (map.scale || 1), sign = low < 0 && value > 0 ? '+' : '';
      ticks.append(element('span', {textContent: `${sign}${map.scale ? +value.toPrecision(3) : +value.toFixed(2)}`.replace('-', '\u2212')}));
    }
    const none = element('i', {style: `background:${map.no_data}`});
    return element('div', {className: 'view3d-legend'}, element('div', {textContent: `${map.title} (mm)`}),
                   bar, ticks, element('small', {}, none, 'no data'));
  };

  // Whether this browser can show the view at all, and words for a reader where it cannot.
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
