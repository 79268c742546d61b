// SPDX-License-Identifier: GPL-3.0-or-later
// Changing the face by hand: a point of it is held and pulled, at the level that is chosen. Every pull is an edit of
// control vertices in edits.yaml, which `semblance edit` and `semblance run` replay.
import {button, check, element, field, group} from './dom.js';
import {get} from './api.js';
import {act, say, store} from './store.js';

export function sculptPanel({scene, faces}) {
  const options = {level: 2, reach: 2, mirror: true};
  let held = null;  // {point, normal} on the face

  const words = element('p'), count = element('p', {className: 'soft'});
  const level = element('input', {type: 'range', min: 0, max: 3, step: 1, value: options.level,
                                  oninput: () => { options.level = Number(level.value); levelWords.textContent = level.value; }});
  const levelWords = element('output', {textContent: String(options.level)});
  const reach = element('input', {type: 'range', min: 1, max: 6, step: 0.5, value: options.reach, oninput: () => { options.reach = Number(reach.value); }});
  const mirror = element('input', {type: 'checkbox', checked: true, onchange: () => { options.mirror = mirror.checked; }});
  const distance = element('input', {type: 'number', value: 2, min: -30, max: 30, step: 0.5});
  const library = element('div');

  const pull = (by) => act('pull', {at: held.point.toArray(), by: by.toArray(), ...options}).then((done) => {
    if (done) { hold({point: held.point.clone().add(by), normal: held.normal}); }
  });
  const alongNormal = (sign) => held && pull(held.normal.clone().multiplyScalar(sign * Number(distance.value)));
  const outwards = button('Pull out', () => alongNormal(1)), inwards = button('Push in', () => alongNormal(-1));

  const hold = (point) => {
    held = point;
    scene.putArrow(held && held.point, held && held.point.clone().addScaledVector(held.normal, 12));
    outwards.disabled = inwards.disabled = !held;
  };
  const pick = (hitOf) => {
    const hit = hitOf(['face']);
    if (!hit) { hold(null); return; }
    hold({point: hit.point, normal: hit.face.normal.clone()});
  };

  const drawLibrary = async () => {
    store.files = await get('files');
    const {parts, features} = store.files;
    const part = element('select', {}, ...parts.map((name) => element('option', {value: name, textContent: name.replaceAll('_', ' ')})));
    const name = element('input', {type: 'text', placeholder: 'name', maxLength: 60});
    const keep = button('Keep', async () => {
      if (await act('keep_feature', {part: part.value, name: name.value.trim()})) { drawLibrary(); }
    });
    library.replaceChildren(group('Features',
        element('div', {className: 'row'}, part, name, keep),
        element('small', {className: 'doc', textContent: 'Keeps the detail of a part in features/; the slider mixes one that is kept into this face.'}),
        ...features.map((feature) => field(feature, element('input', {type: 'range', min: 0, max: 1, step: 0.05, value: 0,
            onchange: (event) => act('blend_feature', {name: feature, weight: Number(event.target.value)})})))));
  };

  const root = element('div', {}, words,
      group('Hold and pull',
            field('level', element('span', {className: 'row'}, level, levelWords), 'a coarse level moves much of the face, a fine one little'),
            field('how far around', reach), check('Both sides alike', mirror), field('distance (mm)', distance),
            element('div', {className: 'row'}, outwards, inwards)),
      library, count, button('Take all edits back', () => act('clear_edits')));
  outwards.disabled = inwards.disabled = true;

  const state = (now) => {
    const ready = now.face.fresh;
    words.textContent = ready ? 'Click on the face to hold a point, then pull it out or push it in. Drag turns the head.'
                              : 'Sculpting begins on the full face of the present choices: make it first (the button at the top).';
    for (const control of root.querySelectorAll('input, select, fieldset button')) {
      if (control !== outwards && control !== inwards) { control.disabled = !ready; }
    }
    count.textContent = now.edited_vertices ? `${now.edited_vertices} control vertices are edited.` : 'Nothing is edited.';
    if (faces.finest) { level.max = faces.finest; }
  };
  return {
    element: root,
    state,
    show: () => {
      scene.onPick = pick;
      drawLibrary().catch((error) => say(error.message)).then(() => state(store.state));
    },
    hide: () => { scene.onPick = null; hold(null); }
  };
}
