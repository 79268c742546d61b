// SPDX-License-Identifier: GPL-3.0-or-later
// Opening a head, and whether it lies and measures as a head does.
import {post, upload} from './api.js';
import {button, element, field, group, lines, select} from './dom.js';
import {act, say, take} from './store.js';

const SIZES = ['left to right', 'front to back', 'height'];

const opened = async (answer) => {
  try {
    take(await answer);
    say('');
  } catch (error) {
    say(error.message);
  }
};

// A file of the browser's own choosing, or a path on this machine.
export const fileChooser = (label, as, accept) => {
  const file = element('input', {type: 'file', accept, onchange: () => file.files[0] && opened(upload(file.files[0], as))});
  const path = element('input', {type: 'text', placeholder: 'or a path on this machine', spellcheck: false});
  const open = button('Open', () => opened(post('open', {as, path: path.value.trim()})));
  path.addEventListener('keydown', (event) => { if (event.key === 'Enter') { open.click(); } });
  file.setAttribute('aria-label', label);
  path.setAttribute('aria-label', `${label}: path`);
  return element('div', {className: 'chooser'}, element('strong', {textContent: label}), file,
                 element('div', {className: 'row'}, path, open));
};

export function skullPanel() {
  const facts = element('div');
  const root = element('div', {},
      element('p', {textContent: 'A mesh of the skull, and of the skin where it is known. A CT is opened from the terminal: semblance workbench VOLUME.'}),
      fileChooser('Skull', 'skull', '.ply,.obj,.stl,.off'), fileChooser('Skin (may be missing)', 'skin', '.ply,.obj,.stl,.off'),
      facts);
  const state = (now) => {
    const {subject, values} = now;
    const size = subject.size_mm || [];
    facts.replaceChildren(...(subject.triangles ? [group('As it is read',
        element('p', {className: 'soft', textContent: `${subject.skull}: ${subject.triangles.toLocaleString('en')} triangles`}),
        element('ul', {className: 'sizes'}, ...size.map((mm, k) => element('li', {},
            element('span', {textContent: SIZES[k]}), element('strong', {textContent: `${mm.toFixed(mm < 10 ? 2 : 0)} mm`})))),
        element('p', {className: 'soft', textContent: 'A head is about 150 mm wide, 190 mm deep and 200 mm high. Seen with Front, it should look at you, upright; the compass names its sides.'}),
        field('axes of the file', select([['LPS', 'LPS: +x left, +y back'], ['RAS', 'RAS: +x right, +y front']], values.subject.axes,
              (value) => act('set', {path: 'subject.axes', value}))),
        field('its unit', select([['mm', 'millimetre'], ['cm', 'centimetre'], ['in', 'inch'], ['m', 'metre']], values.subject.units,
              (value) => act('set', {path: 'subject.units', value}))),
        lines(subject.faults, 'bad'), lines(subject.notes, 'soft'))] : [
        element('p', {className: 'soft', textContent: 'No skull is open yet.'})]));
  };
  return {element: root, state};
}
