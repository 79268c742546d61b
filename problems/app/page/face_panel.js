// SPDX-License-Identifier: GPL-3.0-or-later
// The options that lead to a face: the few that matter most, single depths, and all others.
import {controlAt, tree} from './controls.js';
import {button, check, element, field, group, lines} from './dom.js';
import {isStated} from './person_panel.js';
import {act, nameOf, store} from './store.js';

const MAIN = [['tissue.depths', 'depths from'], ['template', 'template'], ['face', 'method'], ['interp', 'interpolation']];
const HIDDEN = ['subject', 'title', 'record', 'edits', 'base'];

function stateLine(faces) {
  const {kind, words, seconds, change, coloured} = faces;
  if (kind === 'none') { return element('p', {className: 'bad', textContent: words || 'No face yet.'}); }
  const what = kind === 'full' ? 'Full face.' : `Coarse face, made in ${seconds.toFixed(2)} s from the depths alone. The full face also uses the bone and the fit.`;
  const moved = coloured && change ? ` Change: mean ${change.mean.toFixed(2)} mm, at most ${change.most.toFixed(1)} mm.` : '';
  return element('p', {className: 'face-state', textContent: what + moved, dataset: {kind}});
}

// A slider for the depth of a site. The face follows while it is dragged; the depth is stored when it is released.
function depthRow(dowel, faces) {
  const path = `tissue.set_mm.${dowel.site}`, isSet = store.state.settings.some((setting) => setting.path === path);
  const shown = element('output', {textContent: `${dowel.depth_mm.toFixed(1)}`});
  const slider = element('input', {type: 'range', min: 0.5, max: Math.max(30, Math.ceil(dowel.depth_mm) + 5), step: 0.1, value: dowel.depth_mm});
  slider.setAttribute('aria-label', `depth at ${nameOf(dowel.site)} in mm`);
  slider.addEventListener('input', () => {
    shown.textContent = Number(slider.value).toFixed(1);
    faces.tryOut(path, Number(slider.value));
  });
  slider.addEventListener('change', () => act('set', {path, value: Number(slider.value)}));
  const sd = dowel.sd_mm === null ? '' : `, standard deviation ${dowel.sd_mm.toFixed(1)} mm`;
  return element('div', {className: `depth${isSet ? ' set' : ''}`, title: `${nameOf(dowel.site)}${sd}`, dataset: {site: dowel.site}},
      element('span', {textContent: nameOf(dowel.site)}), slider, shown,
      isSet ? button('\u21ba', () => act('unset', {path}), {className: 'reset', title: 'back to the depth of the table or the measurement'}) : element('i'));
}

export function facePanel(bench) {
  const {faces, scene} = bench, show = (name) => bench.show(name), person = element('div');
  const line = element('div'), main = element('div'), depths = element('div', {className: 'depths'}), notes = element('div');
  const all = element('div'), search = element('input', {type: 'search', placeholder: 'find an option'});
  const colour = element('input', {type: 'checkbox', onchange: () => faces.colour(colour.checked)});
  const pin = element('input', {type: 'checkbox', onchange: () => faces.pin(pin.checked)});
  const clear = element('input', {type: 'range', min: 0.1, max: 1, step: 0.05, value: scene.shared.layers.get('face').opacity,
                                  oninput: () => { scene.shared.layers.get('face').opacity = Number(clear.value); scene.update(); }});
  search.setAttribute('aria-label', 'find an option');
  const root = element('div', {}, person, line,
      group('Show', check('Colour the last change', colour), check('Compare with the present face from now on', pin), field('opacity of the face', clear)),
      group('Main options', main), element('details', {open: true}, element('summary', {textContent: 'Depths, mm'}), depths),
      element('details', {}, element('summary', {textContent: 'All options'}), search, all), notes);

  const drawDepths = () => {
    if (document.activeElement && depths.contains(document.activeElement) && document.activeElement.type === 'range' && faces.busy) { return; }
    const chosen = document.activeElement && depths.contains(document.activeElement) ? document.activeElement.closest('.depth')?.dataset.site : null;
    depths.replaceChildren(...faces.dowels.map((dowel) => depthRow(dowel, faces)));
    if (chosen) { depths.querySelector(`[data-site="${CSS.escape(chosen)}"] input`)?.focus(); }
  };
  const drawAll = () => {
    const words = search.value.trim().toLowerCase();
    const matches = (path, schema) => `${path} ${schema.description || ''}`.toLowerCase().includes(words);
    all.replaceChildren(...Object.entries(store.schema.properties).filter(([key]) => !HIDDEN.includes(key))
        .flatMap(([key, schema]) => tree(key, schema, store.state.values[key], matches, words !== '')));
  };
  const drawFace = () => {
    line.replaceChildren(stateLine(faces), lines(faces.faults.map(({fault}) => `Not usable: ${fault}`), 'bad') || '');
    notes.replaceChildren(faces.notes.length ? element('details', {}, element('summary', {textContent: `Notes (${faces.notes.length})`}),
                                                       lines(faces.notes, 'soft')) : '');
    drawDepths();
  };
  search.addEventListener('input', drawAll);
  faces.onChange(() => { if (root.isConnected) { drawFace(); } });
  return {
    element: root,
    show: drawFace,
    state: (state, former) => {
      if (former && former.revision === state.revision) { return; }
      person.replaceChildren(isStated(state) ? '' : element('p', {className: 'hint'}, 'This face assumes a male of normal build. ',
          button('State the person', () => show('person'))));
      main.replaceChildren(...MAIN.map(([path, name]) => controlAt(path, name)).filter((made) => made));
      drawAll();
    }
  };
}
