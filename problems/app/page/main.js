// SPDX-License-Identifier: GPL-3.0-or-later
// The workbench: tabs in the order of the work, one view, and the keys.
import {get} from './api.js';
import {button, element} from './dom.js';
import {Faces} from './faces.js';
import {Job} from './job.js';
import {comparePanel} from './compare_panel.js';
import {facePanel} from './face_panel.js';
import {landmarkPanel} from './landmark_panel.js';
import {measurePanel} from './measure_panel.js';
import {sculptPanel} from './sculpt_panel.js';
import {skullPanel} from './skull_panel.js';
import {Opener, takeDrops} from './opener.js';
import {Scene} from './scene.js';
import {act, begin, choose, onState, showMessage, store} from './store.js';

const TABS = [['skull', 'Skull', skullPanel], ['landmarks', 'Landmarks', landmarkPanel], ['face', 'Face', facePanel],
              ['sculpt', 'Sculpt', sculptPanel], ['compare', 'Compare', comparePanel], ['measure', 'View', measurePanel]];

const byId = (id) => document.getElementById(id);

// Each panel is {element, show(), hide(), state(state, former)}. The three functions are optional.
function makeTabs(bench) {
  const panels = new Map();
  let shown = null;
  const show = (name) => {
    if (shown === name) { return; }
    if (shown && panels.get(shown).hide) { panels.get(shown).hide(); }
    shown = name;
    for (const tab of byId('tabs').children) { tab.setAttribute('aria-selected', String(tab.dataset.tab === name)); }
    const panel = panels.get(name);
    byId('panel').replaceChildren(panel.element);
    byId('panel').scrollTop = 0;
    showMessage('');
    if (panel.show) { panel.show(); }
    if (panel.state && store.state) { panel.state(store.state, null); }
  };
  for (const [n, [name, title, make]] of TABS.entries()) {
    panels.set(name, make(bench));
    byId('tabs').append(button(title, () => show(name), {role: 'tab', dataset: {tab: name}, title: `${title} (${n + 1})`}));
  }
  onState((state, former) => {
    const panel = panels.get(shown);
    if (panel && panel.state) { panel.state(state, former); }
  });
  return show;
}

function showHeader(state) {
  byId('subject').textContent = state.subject.name || 'Semblance';
  document.title = `${state.subject.name || 'Semblance'} \u2013 workbench`;
  const {undo, redo} = state.steps;
  byId('undo').disabled = !undo;
  byId('redo').disabled = !redo;
  byId('undo').title = undo ? `undo: ${undo} (Ctrl+Z)` : 'nothing to undo';
  byId('redo').title = redo ? `redo: ${redo} (Ctrl+Shift+Z)` : 'nothing to redo';
  byId('saved').replaceChildren('All work is saved in ', element('code', {textContent: state.folder}), ' \u00b7 the same face from the terminal: ',
      element('code', {textContent: `semblance run ${state.folder}/config.yaml`}));
}

function takeKeys(show) {
  document.addEventListener('keydown', (event) => {
    const types = ['INPUT', 'SELECT', 'TEXTAREA'].includes(event.target.tagName) && event.target.type !== 'range';
    if ((event.ctrlKey || event.metaKey) && event.key.toLowerCase() === 'z' && !types) {
      event.preventDefault();
      act(event.shiftKey ? 'redo' : 'undo');
    } else if (!types && !event.ctrlKey && !event.altKey && !event.metaKey && /^[1-6]$/.test(event.key)) {
      show(TABS[Number(event.key) - 1][0]);
    } else if (event.key === 'Escape') {
      choose(null);
    }
  });
}

async function main() {
  if (!SemblanceGuides.canShow()) {
    byId('view').replaceChildren(element('p', {className: 'empty',
      textContent: 'This browser shows no 3-D pictures: its WebGL is off, or this machine has none. The workbench needs WebGL.'}));
    return;
  }
  const scene = new Scene(byId('view'));
  const bench = {scene, faces: new Faces(scene), store, opener: new Opener(byId('opening'))};
  scene.pace.isBusy = () => bench.faces.busy;
  window.semblance = bench;  // for the browser's console and for tests
  const job = new Job(byId('job'), byId('run'));
  const show = makeTabs(bench);
  bench.show = show;
  byId('undo').addEventListener('click', () => act('undo'));
  byId('redo').addEventListener('click', () => act('redo'));
  onState(showHeader);
  onState((state, former) => showMeshes(scene, state, former));
  onState((state, former) => bench.faces.state(state, former));
  onState((state) => job.state(state));
  takeKeys(show);
  takeDrops(bench.opener);
  await begin();
  show(store.state.subject.triangles ? (store.state.landmarks.length ? 'face' : 'landmarks') : 'skull');
}

async function showMeshes(scene, state, former) {
  if (former && former.subject.revision === state.subject.revision) { return; }
  scene.put('face', null);  // it belongs to another head
  const {skull, skin} = await get('meshes');
  scene.put('skull', skull);
  scene.put('skin', skin);
  document.body.classList.toggle('empty-bench', !skull);
}

main().catch((error) => showMessage(error.message));
