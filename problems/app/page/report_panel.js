// SPDX-License-Identifier: GPL-3.0-or-later
// The report of the case, the complete head, and the files for other programs.
import {get} from './api.js';
import {button, check, element, field, group, select} from './dom.js';
import {isRunning, reportLink} from './job.js';
import {FACE_FORMATS, act, download, showMessage, store} from './store.js';

const HEAD_FORMATS = [['.glb', 'GLB: in colours, for viewers'], ['.stl', 'STL: for 3-D printing'], ['.obj', 'OBJ: for modelling'], ['.ply', 'PLY']];

function saveRow(name, formats, chosen, save, disabled) {
  const format = select(formats, chosen, () => {});
  format.setAttribute('aria-label', `kind of file: ${name}`);
  return field(name, element('span', {className: 'row'}, format, button('Save', () => save(format.value), {disabled, dataset: {save: name}})));
}

export function reportPanel(bench) {
  const {scene} = bench, layer = (id) => scene.shared.layers.get(id);
  const status = element('div'), files = element('div');
  const box = element('input', {type: 'checkbox', onchange: () => showHead(box.checked)});
  let revision = -1;  // of the shown head

  const hideHead = () => { layer('head').shown = false; layer('face').shown = true; scene.update(); };
  const showHead = async (on) => {
    if (!on) { hideHead(); return; }
    try {
      if (revision !== store.state.face.revision) {
        scene.put('head', (await get('head')).mesh);
        revision = store.state.face.revision;
      }
      layer('head').shown = true;
      layer('face').shown = false;
      scene.update();
      showMessage('');
    } catch (error) {
      box.checked = false;
      showMessage(error.message);
    }
  };
  const headBox = check('Show the complete head (ears, eyes, neck)', box);
  const root = element('div', {}, status, headBox, files);

  const statusOf = ({face, landmarks}) => {
    const runs = isRunning() && store.state.job.name === 'run';
    const make = button(face.there ? 'Make the face and the report again' : 'Make the face and the report', () => bench.makeFace(),
                        {className: 'primary', disabled: runs || landmarks.length === 0});
    if (face.saved) { return [element('p', {textContent: 'The report belongs to the present state of the case.'}), element('p', {}, reportLink(face))]; }
    return [element('p', {className: face.there ? 'bad' : 'soft', textContent: face.there
                ? 'The case has changed since the report was made: it is out of date.' : 'There is no report yet. It comes with the full face.'}),
            face.there ? element('p', {}, reportLink(face)) : '', make];
  };
  const state = (now) => {
    const {face} = now;
    status.replaceChildren(group('Report', ...statusOf(now)));
    headBox.hidden = !face.saved || !face.head;
    if (box.checked && (!face.saved || revision !== face.revision)) { box.checked = false; hideHead(); }
    files.replaceChildren(group('Export',
        saveRow('face', FACE_FORMATS.map((ending) => [ending, ending]), '.ply', (format) => download('export', {format}), !face.there),
        saveRow('complete head', HEAD_FORMATS, '.glb', (format) => download('export_head', {format}), !face.saved || !face.head),
        saveRow('landmarks', [['.yaml', 'YAML'], ['.mrk.json', '3D Slicer'], ['.csv', 'table (.csv)']], '.yaml',
                (format) => download('landmarks', {format}), !now.landmarks.length),
        field('view', button('Save picture', () => scene.picture())),
        element('small', {className: 'doc', textContent: 'Meshes are in mm, LPS; GLB is in metres, as its format demands. The face alone is the mask that was fitted; ears, eyes and neck of the complete head come from the template and are not this person\u2019s.'})));
  };
  return {element: root, state, hide: () => { if (box.checked) { box.checked = false; hideHead(); } }};
}
