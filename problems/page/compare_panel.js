// SPDX-License-Identifier: GPL-3.0-or-later
// Variants side by side under one camera: builds of a table, or all depths a standard deviation less and more.
import {get} from './api.js';
import {button, check, element} from './dom.js';
import {say, store} from './store.js';

const SETS = {
  builds: [['emaciated', 'Emaciated'], ['normal', 'Normal'], ['obese', 'Obese']],
  deviations: [['thinner', 'All depths \u2212 1 SD'], ['as_is', 'As chosen'], ['thicker', 'All depths + 1 SD']],
};
const MIDDLE = 1;

export function comparePanel({scene}) {
  let chosen = 'builds', shown = false, asked = 0;
  const colour = element('input', {type: 'checkbox', checked: true, onchange: () => draw()});
  const buttons = Object.entries({builds: 'Builds', deviations: '\u00b1 1 standard deviation'}).map(([name, text]) =>
      button(text, () => { chosen = name; draw(); }, {dataset: {set: name}}));
  const status = element('p', {className: 'soft', role: 'status'});
  const note = element('p', {className: 'bad'});
  const root = element('div', {},
      element('p', {textContent: 'Coarse faces of the same head, side by side. Colours say how far each lies outside (+) or inside (\u2212) the middle one.'}),
      element('div', {className: 'row'}, ...buttons), check('Colour the difference', colour), note, status,
      element('small', {className: 'doc', textContent: 'Where a table states no standard deviation, 3 mm is taken, the mean of the T-Table 2023. A pooled table has one build.'}));

  const draw = async () => {
    const measured = store.state.values.tissue.depths === 'measured';
    note.textContent = measured ? 'The depths of this head are measured: builds of a table change nothing.' : '';
    const turn = ++asked;
    status.textContent = 'Working \u2026';
    for (const made of buttons) { made.setAttribute('aria-pressed', String(made.dataset.set === chosen)); }
    try {
      const faces = [];
      for (const [variant] of SETS[chosen]) { faces.push(await get('coarse', {variant})); }
      if (turn !== asked || !shown) { return; }
      const middle = SemblanceGeometry.geometryOf(faces[MIDDLE].mesh);
      scene.compare(SETS[chosen].map(([, title], k) => ({
        title, face: faces[k].mesh, dowels: faces[k].dowels, former: colour.checked && k !== MIDDLE ? middle : null})));
      status.textContent = '';
      say('');
    } catch (error) {
      status.textContent = '';
      say(error.message);
    }
  };
  return {
    element: root,
    show: () => { shown = true; },
    state: (state, former) => { if (!former || former.revision !== state.revision) { draw(); } },
    hide: () => { shown = false; scene.compare([]); }
  };
}
