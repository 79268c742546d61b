// SPDX-License-Identifier: GPL-3.0-or-later
// Visible layers, view directions, and the measuring tools of the report's view.
import {button, element, group} from './dom.js';

const VIEWS = [['Front', 0, 0], ['Three-quarter', 35, 8], ['Left', 90, 0], ['Right', -90, 0], ['Back', 180, 0], ['Top', 0, 89]];
const NAMES = {skull: 'skull', skin: 'true skin', dowels: 'depth markers', face: 'face'};

export function measurePanel({scene}) {
  const layers = element('div'), tools = element('div');
  const row = (id) => {
    const state = scene.shared.layers.get(id);
    const box = element('input', {type: 'checkbox', checked: state.shown, onchange: () => { state.shown = box.checked; scene.update(); }});
    const slider = element('input', {type: 'range', min: 0.1, max: 1, step: 0.05, value: state.opacity,
                                     oninput: () => { state.opacity = Number(slider.value); scene.update(); }});
    slider.setAttribute('aria-label', `opacity of the ${NAMES[id]}`);
    return element('div', {className: 'layer'}, element('label', {}, box, NAMES[id]), id === 'dowels' ? '' : slider);
  };
  const root = element('div', {},
      group('Look from', element('div', {className: 'view3d-buttons'}, ...VIEWS.map(([name, turn, rise]) =>
          button(name, () => scene.shared.camera && scene.shared.camera.look(turn, rise))))),
      group('Show', layers), tools, button('Save picture', () => scene.picture()));
  return {
    element: root,
    show: () => {
      layers.replaceChildren(...Object.keys(NAMES).map(row));
      if (scene.measure && !tools.firstChild) {
        tools.append(group('Measure', ...scene.measure.controls(document.getElementById('view'))));
      }
    },
    hide: () => { if (scene.measure && scene.measure.tool !== 'none') { scene.measure.setTool(scene.measure.tool); } }
  };
}
