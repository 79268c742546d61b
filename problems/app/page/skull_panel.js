// SPDX-License-Identifier: GPL-3.0-or-later
// Opens a head, and shows whether its size and pose are those of a head.
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

export function skullPanel({scene, opener}) {
  const facts = element('div');
  const look = (name, turn, rise) => button(name, () => scene.shared.camera && scene.shared.camera.look(turn, rise));
  const root = element('div', {},
      element('p', {textContent: 'Drop files anywhere on this page, choose them, or enter a path: a mesh of a skull; a CT (all slices together, their folder, or a file); landmarks; a configuration.'}),
      chooser(opener, 'Open'), facts);
  const state = (now) => {
    facts.replaceChildren(...(now.subject.triangles
        ? [asRead(now), element('div', {className: 'row'}, look('Front', 0, 0), look('Left', 90, 0), look('Top', 0, 89))]
        : [element('p', {className: 'soft', textContent: 'No skull is open yet.'})]));
  };
  return {element: root, state};
}
