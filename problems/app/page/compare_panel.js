// SPDX-License-Identifier: GPL-3.0-or-later
// Variants side by side under one camera: builds of a table, or all depths minus and plus a standard deviation. They are
// coarse at first, and full once they have been made.
import {get} from './api.js';
import {sizeOf} from './scene.js';
import {button, check, element, select} from './dom.js';
import {FACE_FORMATS, act, download, showMessage, store} from './store.js';

const TITLES = {emaciated: 'Emaciated', normal: 'Normal', obese: 'Obese', thinner: '\u2212 1 SD', as_is: 'Present', thicker: '+ 1 SD'};
const SETS = {
  builds: {text: 'Builds', variants: ['emaciated', 'normal', 'obese'], middle: 'normal'},
  deviations: {text: '\u00b1 1 standard deviation', variants: ['thinner', 'as_is', 'thicker'], middle: 'as_is'},
  all: {text: 'All', variants: ['emaciated', 'normal', 'obese', 'thinner', 'as_is', 'thicker'], middle: 'as_is'},
};

// Title and distances from the middle face.
const caption = (title, values) => {
  if (!values) { return [title]; }
  const {mean, most} = sizeOf(values);
  return [title, element('small', {textContent: `mean ${mean.toFixed(1)} mm, at most ${most.toFixed(1)} mm`})];
};

export function comparePanel({scene}) {
  let chosen = 'builds', shown = false, asked = 0, drawn = '';
  const colour = element('input', {type: 'checkbox', checked: true, onchange: () => draw()});
  const buttons = Object.entries(SETS).map(([name, {text}]) =>
      button(text, () => { chosen = name; draw(); }, {dataset: {set: name}}));
  const status = element('p', {className: 'soft', role: 'status'}), kind = element('p', {className: 'compare-kind'});
  const note = element('p', {className: 'bad'}), make = element('div', {className: 'row'}), save = element('div');
  const format = select(FACE_FORMATS.map((ending) => [ending, ending]), '.ply', () => {});
  format.setAttribute('aria-label', 'kind of file');
  const legend = element('div', {className: 'legend-place'}), home = scene.legend.parentElement;
  const root = element('div', {},
      element('p', {textContent: 'Faces of the same head, side by side under one camera. Colours show the distance of each face outside (+) or inside (\u2212) the middle one.'}),
      element('div', {className: 'row'}, ...buttons), check('Colour the difference', colour), legend, note, kind, make, status, save,
      element('small', {className: 'doc', textContent: 'If a table states no standard deviation, 3 mm is used, the mean of the T-Table 2023. A pooled table has only one build. The full faces are stored in variants/; semblance run FOLDER/config.yaml --set tissue.build=obese makes the same face.'}));

  const missing = () => SETS[chosen].variants.filter((name) => !store.state.variants.includes(name));

  const drawFull = () => {
    const left = missing(), running = store.state.job.state === 'running' && store.state.job.name === 'variants';
    kind.textContent = left.length ? 'Coarse faces, made from the depths alone.' : 'Full faces.';
    kind.dataset.kind = left.length ? 'coarse' : 'full';
    make.replaceChildren(left.length && !running ? button(`Make ${left.length === SETS[chosen].variants.length ? 'the' : `the other ${left.length}`} full faces`,
        () => act('variants', {variants: left}), {className: 'primary', dataset: {make: 'variants'}}) : '');
    const made = SETS[chosen].variants.filter((name) => store.state.variants.includes(name));
    save.replaceChildren(made.length ? element('div', {className: 'row'}, 'Save', format, ...made.map((name) => button(TITLES[name], () =>
        download('export', {variant: name, format: format.value})))) : '');
  };

  const show = (faces) => {
    const {variants, middle} = SETS[chosen];
    const reference = SemblanceGeometry.geometryOf(faces[variants.indexOf(middle)].mesh);
    scene.compare(variants.map((name, k) => ({
      title: TITLES[name] + ((faces[k].faults || []).length ? ' (not usable)' : ''), face: faces[k].mesh, dowels: faces[k].dowels, former: name === middle ? null : reference})), {coloured: colour.checked, caption});
  };

  const draw = async () => {
    const {tissue} = store.state.values, {variants} = SETS[chosen];
    note.textContent = tissue.depths === 'measured' && chosen !== 'deviations' ? 'The depths of this head are measured; the build of a table does not change them.' : '';
    const turn = ++asked;
    status.textContent = 'Working \u2026';
    for (const made of buttons) { made.setAttribute('aria-pressed', String(made.dataset.set === chosen)); }
    drawFull();
    const from = missing().length ? 'coarse' : 'variant';
    drawn = keyOf(store.state);
    try {
      const faces = [];
      for (const variant of variants) { faces.push(await get(from, {variant})); }
      if (turn !== asked || !shown) { return; }
      show(faces);
      status.textContent = '';
      showMessage('');
    } catch (error) {
      status.textContent = '';
      if (turn === asked && shown) { showMessage(error.message); }
    }
  };
  // Key of all that the pictures depend on.
  const keyOf = (state) => JSON.stringify([state.revision, chosen, SETS[chosen].variants.filter((name) => !state.variants.includes(name)).length > 0]);
  return {
    element: root,
    show: () => { shown = true; drawn = ''; legend.append(scene.legend); },
    state: (state) => { if (keyOf(state) !== drawn) { draw(); } else { drawFull(); } },
    hide: () => { shown = false; home.append(scene.legend); scene.compare([]); }
  };
}
