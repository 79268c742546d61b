// SPDX-License-Identifier: GPL-3.0-or-later
// Opens a head, shows whether its size and pose are those of a head, and removes from it what is no bone.
import {button, element, field, group, lines, select} from './dom.js';
import {chooser} from './opener.js';
import {act} from './store.js';

const SIZES = ['left to right', 'front to back', 'height'];
const UNITS = [['mm', 'millimetre', 1], ['cm', 'centimetre', 10], ['in', 'inch', 25.4], ['m', 'metre', 1000]];
const HEAD_MM = [120, 320];  // range of the longest side of a skull or a part of one

// The unit in which the file has the size of a head; null if the present unit already gives that size, or no unit does.
const unitPredicted = (size_mm, unit) => {
  const longest = Math.max(...size_mm), fits = (mm) => mm >= HEAD_MM[0] && mm <= HEAD_MM[1];
  const now = UNITS.find(([name]) => name === unit)[2];
  return fits(longest) ? null : UNITS.find(([, , factor]) => fits(longest / now * factor)) || null;
};

const nameOf = (path) => path.split('/').pop();

function asRead({subject, values}) {
  const {axes, units} = values.subject, unit = unitPredicted(subject.size_mm, units);
  return group('As read',
      element('p', {className: 'soft', title: subject.skull, textContent: `${nameOf(subject.skull)}: ${subject.triangles.toLocaleString('en')} triangles`}),
      element('ul', {className: 'sizes'}, ...subject.size_mm.map((mm, k) => element('li', {},
          element('span', {textContent: SIZES[k]}), element('strong', {textContent: `${mm.toFixed(mm < 10 ? 2 : 0)} mm`})))),
      unit ? element('div', {className: 'row hint'}, `In ${unit[1]}s it would have the size of a head.`,
                     button(`Use ${unit[1]}s`, () => act('set', {path: 'subject.units', value: unit[0]}), {className: 'primary'})) : null,
      element('p', {className: 'soft', textContent: 'A head is about 150 mm wide, 190 mm deep and 200 mm high. In the view Front it should face you, upright; the compass names its sides.'}),
      field('axes of the file', select([['LPS', 'LPS: +x left, +y back'], ['RAS', 'RAS: +x right, +y front']], axes || 'LPS',
            (value) => act('set', {path: 'subject.axes', value}))),
      field('unit of the file', select(UNITS, units, (value) => act('set', {path: 'subject.units', value}))),
      subject.skin ? element('div', {className: 'row'}, element('span', {className: 'soft', title: subject.skin, textContent: `Skin: ${nameOf(subject.skin)}`}),
                             button('Remove the skin', () => act('set', {path: 'subject.skin', value: ''}))) : null,
      lines(subject.faults, 'bad'), lines(subject.notes, 'soft'));
}

// Removal of bone that is none: a click on a piece, or on the middle of a ball. Calls done() at a change of the tool.
function removal() {
  let tool = null;
  const radius = element('input', {type: 'range', min: 1, max: 20, step: 1, value: 5, oninput: () => { size.textContent = `${radius.value} mm`; }});
  const size = element('output', {textContent: '5 mm'}), hint = element('p', {className: 'hint', hidden: true});
  radius.setAttribute('aria-label', 'radius of the ball in mm');
  const TEXTS = {piece: 'Click on a piece that is no bone: the whole piece goes. Undo restores it.',
                 ball: 'Click on what is no bone: all within the ball goes. Undo restores it.'};
  const choose = (name) => {
    tool = tool === name ? null : name;
    for (const made of buttons) { made.setAttribute('aria-pressed', String(made.dataset.remove === tool)); }
    hint.hidden = !tool;
    hint.textContent = tool ? TEXTS[tool] : '';
  };
  const buttons = [button('A whole piece', () => choose('piece'), {dataset: {remove: 'piece'}}),
                   button('A ball around the click', () => choose('ball'), {dataset: {remove: 'ball'}})];
  const made = element('details', {}, element('summary', {textContent: 'Remove tubes, metal, head holder'}),
      element('div', {className: 'row'}, ...buttons), field('radius of the ball', radius, ''), size, hint);
  const pick = (hitOf) => {
    const hit = tool && hitOf(['skull']);
    if (hit) { act('remove_bone', {near: hit.point.toArray(), within_mm: tool === 'ball' ? Number(radius.value) : null}); }
  };
  return {made, pick, stop: () => { if (tool) { choose(tool); } }};
}

export function skullPanel(bench) {
  const {scene, opener} = bench;
  const facts = element('div'), remover = removal();
  const look = (name, turn, rise) => button(name, () => scene.shared.camera && scene.shared.camera.look(turn, rise));
  const root = element('div', {},
      facts, remover.made,
      element('p', {textContent: 'Drop files anywhere on this page, choose them, or enter a path: a mesh of a skull; a CT (all slices together, their folder, or a file); landmarks; a configuration.'}),
      chooser(opener, 'Open'));
  const state = (now) => {
    remover.made.hidden = !now.subject.triangles;
    facts.replaceChildren(...(now.subject.triangles
        ? [element('p', {className: 'hint', textContent: 'Is this the whole skull, upright, facing you in the view Front?'}),
           element('div', {className: 'row'}, look('Front', 0, 0), look('Left', 90, 0), look('Top', 0, 89)),
           element('div', {className: 'row'}, button('Yes: go on to the landmarks', () => bench.show('landmarks'), {className: 'primary', dataset: {go: 'landmarks'}})),
           asRead(now)]
        : [element('p', {className: 'soft', textContent: 'No skull is open yet.'})]));
  };
  // This step shows bare bone, because a person judges its frame here.
  const showFace = (shown) => {
    for (const id of ['face', 'dowels']) { scene.shared.layers.get(id).shown = shown; }
    scene.update();
  };
  return {element: root, state, 
          show: () => { showFace(false); scene.onPick = remover.pick; },
          hide: () => { showFace(true); scene.onPick = null; remover.stop(); }};
}
